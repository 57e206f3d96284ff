"""Simulation of built bitstreams."""
