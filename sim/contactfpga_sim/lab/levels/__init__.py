"""One light level of force in each cell, and several, before a board has either."""
