"""Delay of frames to user code by reader, against a C program."""
