"""Pressure units: converter, thresholds, and packets."""
