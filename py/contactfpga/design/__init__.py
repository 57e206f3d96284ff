"""Design of a sheet: the cover over it, its circuit, and its layout."""
