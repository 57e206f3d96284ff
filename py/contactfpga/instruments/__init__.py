"""Measurements on a sheet by its frames: bounce, settling, lines that do not work, cells that look wrong."""
