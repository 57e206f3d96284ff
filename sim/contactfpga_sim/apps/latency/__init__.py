"""Times from a finger on the sheet to the code that acts, by stage."""
