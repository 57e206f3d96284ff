"""Times, sizes and testable predictions of the kits."""
