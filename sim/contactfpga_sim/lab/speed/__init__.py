"""How fast board and driver run on this machine, and whether they run for an hour."""
