"""Diagrams that explain: how the parts fit together, the skin, a touch, the wiring, and a packet."""
