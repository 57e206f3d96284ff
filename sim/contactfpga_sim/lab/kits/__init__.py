"""The kits: times from finger to user code, sizes, and predictions that a builder can test."""
