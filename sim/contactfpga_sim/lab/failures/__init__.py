"""Where methods fail: one knob a study, moved until something breaks, on the compiled gateware."""
