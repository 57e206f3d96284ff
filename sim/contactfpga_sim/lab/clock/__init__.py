"""Board time on the host's clock, over simulated transports."""
