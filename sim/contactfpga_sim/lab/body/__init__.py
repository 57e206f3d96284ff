"""What docs/body.md says of links, registration and folds, by simulation."""
