"""Speed against accuracy: what each method and setting costs and buys, on scenes with a known truth."""
