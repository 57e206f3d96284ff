"""Simulations for docs/body.md of links, registration and folds."""
