"""Speed of board and driver on this machine."""
