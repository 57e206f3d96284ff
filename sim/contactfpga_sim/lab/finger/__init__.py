"""From a finger on the sheet to the code that acts on it, stage by stage."""
