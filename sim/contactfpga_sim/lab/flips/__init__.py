"""Bits of the running gateware flipped one by one: masked, told, or silently wrong."""
