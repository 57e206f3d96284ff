"""The node that publishes a skin."""
