"""Delay and load of the view in a browser."""
