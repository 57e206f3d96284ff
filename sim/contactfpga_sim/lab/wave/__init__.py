"""One touch as a waveform, for a page."""
