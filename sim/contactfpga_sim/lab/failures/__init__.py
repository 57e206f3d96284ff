"""Where methods fail: one parameter per study, moved until something breaks, on the compiled gateware."""
