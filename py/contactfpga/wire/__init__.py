"""Packets on the wire (docs/protocol.md)."""
