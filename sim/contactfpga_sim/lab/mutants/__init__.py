"""Mutants of the netlist that the comparison with the golden model detects."""
