"""The maker's sheet: diodes, resistors and schematic."""
