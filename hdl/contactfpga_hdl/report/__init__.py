"""A frame's content: its summary checked against its cells, and barycenters divided on the board."""
