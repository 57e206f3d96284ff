"""The virtual board: gateware as native code, with its sheet, at a serial port."""
