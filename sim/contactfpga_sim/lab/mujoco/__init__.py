"""Peak forces of arms with and without skin."""
