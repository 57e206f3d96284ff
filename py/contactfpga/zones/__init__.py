"""Zones of a frame and their places, many frames as arrays, and labels and ghosts found on the host."""
