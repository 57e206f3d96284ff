"""Evidence that gateware and model agree: lockstep, proofs, mutants, netlists."""
