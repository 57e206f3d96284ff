"""What a frame reports: its summary checked against its cells, and barycenters divided on the board."""
