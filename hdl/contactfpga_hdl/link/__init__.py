"""The serial link: frames to bytes, and requests from bytes."""
