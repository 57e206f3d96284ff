"""Zones of frames: places, arrays, and labels and ghosts found on the host."""
