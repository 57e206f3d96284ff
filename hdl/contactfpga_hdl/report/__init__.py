"""Contents of frames: checked summaries, and barycenters."""
