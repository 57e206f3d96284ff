"""The maker's sheet: diodes and resistors."""
