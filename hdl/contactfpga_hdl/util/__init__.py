"""Parts for several stages."""
