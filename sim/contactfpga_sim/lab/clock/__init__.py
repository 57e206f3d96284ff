"""Board time on the host's clock, over simulated ways to the host."""
