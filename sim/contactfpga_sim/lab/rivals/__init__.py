"""Labellers of others on our bench."""
