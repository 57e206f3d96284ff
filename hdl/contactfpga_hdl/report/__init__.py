"""Contents of frames."""
