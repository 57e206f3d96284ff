"""Pressure units: their converter, thresholds on what they read, and its packets."""
