"""Quality of tracking on moving scenes with a known truth and on recordings."""
