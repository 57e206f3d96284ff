"""The fields of a Skin file."""
