"""Board time on the host's clock."""
