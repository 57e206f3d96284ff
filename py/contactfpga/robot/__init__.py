"""What serves a robot: links on a body, forces, the network, ROS 2."""
