"""Gateware: from switch samples to bytes on a serial line.

A part that only some Skins have is imported in the method that adds it, so that a Skin loads only its board's parts: a
default one is understood without guard lines, units, self-test, shift registers or a second copy.
"""
