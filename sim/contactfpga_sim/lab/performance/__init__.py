"""Latency, rate and clocks of the gateware."""
