"""Scans of the sheet, and drivers of its pins."""
