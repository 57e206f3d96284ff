"""Debounce between scan and labeller."""
