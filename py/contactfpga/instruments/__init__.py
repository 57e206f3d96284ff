"""Measurements on a sheet from frames: bounce, settling, broken lines, suspicious cells."""
