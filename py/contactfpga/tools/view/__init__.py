"""A live view in the browser: the sheet in 3-D, pressed with the mouse if virtual."""
