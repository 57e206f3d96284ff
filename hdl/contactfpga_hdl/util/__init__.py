"""Parts that several stages use."""
