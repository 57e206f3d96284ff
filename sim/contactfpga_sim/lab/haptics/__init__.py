"""Places finer than the pitch: coverage of the stated uncertainty."""
