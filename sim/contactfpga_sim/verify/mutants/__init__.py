"""Mutation testing of the gateware: does the comparison with the golden model notice netlist changes?"""
