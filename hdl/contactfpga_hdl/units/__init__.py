"""Pressure units: their converter, thresholds on readings, and packets."""
