"""What a frame says of the sheet: zones, many frames as arrays, labels and ghosts found on the host."""
