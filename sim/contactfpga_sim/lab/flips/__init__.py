"""Bits of the running gateware flipped one by one: masked, reported, or silently wrong."""
