"""Gateware: from switch samples to bytes on a serial line.

A part that only some Skins have is imported in the method that adds it. So what is loaded for a Skin is what its board
consists of: a default one is understood without guard lines, units, self-test, shift registers or a second copy.
"""
