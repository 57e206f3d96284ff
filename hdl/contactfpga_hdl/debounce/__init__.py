"""Contact bounce, kept from the later stages."""
