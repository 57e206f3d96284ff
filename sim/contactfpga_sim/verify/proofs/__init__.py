"""Proofs about the gateware, one file per stage, with Yosys' solver; docs/formal.md describes them."""
