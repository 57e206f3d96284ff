"""Proofs about the gateware, one file per stage, with the solver inside Yosys; docs/formal.md says what they show."""
