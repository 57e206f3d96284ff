"""Speed against accuracy, the cheapest Skin that will do, where methods fail, and the arm that stops in time."""
