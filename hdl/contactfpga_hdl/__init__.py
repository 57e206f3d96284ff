"""Gateware: from switch samples to bytes on a serial line."""
