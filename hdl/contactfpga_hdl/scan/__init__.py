"""Which rows are driven when, and their samples: raster and adaptive scans, pins or shift registers."""
