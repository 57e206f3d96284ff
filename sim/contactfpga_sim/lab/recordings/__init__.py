"""Size of recordings, and loss by a killed program."""
