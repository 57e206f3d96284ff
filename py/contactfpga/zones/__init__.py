"""What a frame says of the sheet: zones, their places, many frames as arrays, labels and ghosts found on the host."""
