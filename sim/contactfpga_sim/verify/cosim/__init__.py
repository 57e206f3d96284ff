"""Gateware against golden model, clock by clock, in three simulators."""
