"""Speed against accuracy: cost and benefit of each method and setting, on scenes with a known truth."""
