"""Where methods fail: one knob a study, turned until something breaks, on the compiled gateware."""
