"""Other people's labellers, measured like ours. ``rival.py`` describes the port that they are put into."""
