"""Explanatory diagrams: the parts, the skin, a touch, the wiring, and a packet."""
