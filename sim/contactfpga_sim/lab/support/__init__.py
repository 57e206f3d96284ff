"""Contact surfaces against the contacts that they hold."""
