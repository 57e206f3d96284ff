"""What designs a sheet: the cover over it, and its circuit."""
