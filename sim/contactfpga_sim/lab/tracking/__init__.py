"""Quality of tracking: moving scenes with a known truth, recordings, a baseline, and where it breaks."""
