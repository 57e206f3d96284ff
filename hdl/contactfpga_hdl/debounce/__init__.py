"""Debounce: keeps contact bounce from the later stages."""
