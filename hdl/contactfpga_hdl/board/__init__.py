"""Bitstreams of a Skin for a board (contactfpga.boards)."""
