"""Places finer than the pitch: how often the stated uncertainty covers the contact, also under a wrong model of it."""
