"""Golden model, scenes, virtual board and co-simulation."""
