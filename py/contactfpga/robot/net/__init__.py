"""A board's bytes over a network: published on the machine that has the board, read anywhere, through Eclipse Zenoh."""
