"""Mutation testing: whether comparison with the golden model detects changes of the gateware's netlist."""
