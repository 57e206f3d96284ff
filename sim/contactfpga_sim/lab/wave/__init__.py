"""One touch of docs/wave.md, with its values."""
