"""Bytes on the wire: stuffing and check, packets and their fields, what a board says of itself (docs/protocol.md)."""
