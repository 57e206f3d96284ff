"""The kits: times from the finger to user code, sizes, and predictions that a builder can prove wrong."""
