"""What a built bitstream holds, simulated."""
