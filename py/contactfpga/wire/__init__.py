"""Bytes on the wire: stuffing and check, packets and their fields, a board's hello (docs/protocol.md)."""
