"""Boards, and the way from a Skin to a bitstream. Only `boards` and `pll` load without Amaranth."""
