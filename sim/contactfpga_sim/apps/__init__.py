"""What users run beside the board: fit, latency, MuJoCo, and what these share with the studies."""
