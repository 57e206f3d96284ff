"""Explanatory diagrams."""
