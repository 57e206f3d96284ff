"""Sweep times of pressure units."""
