"""Study of where a precharged scan breaks."""
