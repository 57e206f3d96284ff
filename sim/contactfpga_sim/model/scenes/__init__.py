"""Touches of the sheet: contacts, families of scenes, files, recordings, and the truth about them."""
