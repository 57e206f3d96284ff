"""A board's bytes over a network: published by the machine with the board, read anywhere, through Eclipse Zenoh."""
