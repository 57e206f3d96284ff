"""Speed of board and driver on this machine, and an hour's run."""
