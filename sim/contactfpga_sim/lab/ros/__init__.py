"""Messages to nodes of ROS 2."""
