"""Needs of the C header on microcontrollers."""
