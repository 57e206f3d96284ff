"""Simulated links, registration and folds for docs/body.md."""
