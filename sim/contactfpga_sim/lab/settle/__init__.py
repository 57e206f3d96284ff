"""Where a precharged scan breaks."""
