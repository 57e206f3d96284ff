"""The maker's sheet: diodes, pull-ups, series resistors and the schematic."""
