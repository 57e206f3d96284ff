"""Gateware: from switch samples to bytes on a serial line.

Parts that only some Skins have are imported in the method that adds them, so that a default board is understood without
them. In lists of ports a *pulse* is a level that is high for one clock.
"""
