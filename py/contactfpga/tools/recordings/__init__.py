"""Recordings: MCAP files with every byte of each board, and with messages of ROS 2 (docs/recordings.md)."""
