"""Proofs about the gateware, a file a stage, with the solver inside Yosys; docs/formal.md says what they show."""
