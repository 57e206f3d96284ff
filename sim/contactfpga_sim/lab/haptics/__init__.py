"""Places finer than the pitch: coverage of the stated uncertainty, also under a wrong contact model."""
