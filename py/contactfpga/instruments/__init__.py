"""Measurements on a sheet by its frames: bounce, settling, broken lines, suspicious cells."""
