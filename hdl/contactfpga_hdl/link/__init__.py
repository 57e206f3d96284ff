"""Frames to bytes to the wire, and requests from it."""
