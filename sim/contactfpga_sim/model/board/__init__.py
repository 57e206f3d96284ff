"""The virtual board: the gateware as native code, in a sheet, behind a port."""
