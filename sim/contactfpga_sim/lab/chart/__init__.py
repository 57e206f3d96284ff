"""Speed against accuracy of each method and setting, on scenes with a known truth."""
