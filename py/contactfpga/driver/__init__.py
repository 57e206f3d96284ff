"""From a port to frames: bytes in, a conversation with the board, subscribers notified."""
