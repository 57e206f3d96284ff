"""Electrical faults of a sheet and its board: which are reported, by what means, and how fast."""
