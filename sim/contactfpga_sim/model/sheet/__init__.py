"""The sheet and its wiring, as the board's pins see them."""
