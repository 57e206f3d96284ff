"""Changes of the gateware's source that the default tests notice."""
