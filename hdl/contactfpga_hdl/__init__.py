"""Gateware: from switch samples to bytes on a serial line.

Parts that only some Skins have are imported in the method that adds them, so that a default board is understood without
guard lines, units, self-test, shift registers or a second copy.
"""
