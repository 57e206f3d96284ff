"""The sheet and its wiring, seen from the board's pins."""
