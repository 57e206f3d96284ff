"""Delay of frames to user code with either reader, against a C program on the same line."""
