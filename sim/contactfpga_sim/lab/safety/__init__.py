"""Electrical faults of a sheet and its board: which of them are told, by what, and how fast."""
