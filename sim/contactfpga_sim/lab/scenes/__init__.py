"""Picture of the built-in scenes."""
