"""Support for robots: links on a body, forces, the network, ROS 2."""
