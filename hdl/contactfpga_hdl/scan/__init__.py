"""Driven rows and their samples: raster and adaptive scans, pins or shift registers."""
