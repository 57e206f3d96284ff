"""Places by the order in which cells close: error over time, and where it breaks."""
