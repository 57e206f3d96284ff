"""Other people's labellers, measured like ours. docs/rivals.md describes the port that they are put behind."""
