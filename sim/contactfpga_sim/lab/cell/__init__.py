"""Resistive cells read by the time in which a column falls."""
