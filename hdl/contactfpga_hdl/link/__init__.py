"""Frames to bytes on the wire, and requests from it."""
