"""Electrical faults of a sheet and its board: which are reported, how, and how fast."""
