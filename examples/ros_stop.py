"""A ROS 2 node that publishes `/stop`: True on contact, on a fault and when the skin sends nothing.

    contactfpga ros              # or the node: ros2 run contactfpga_ros skin
    python examples/ros_stop.py  # in a shell that knows the workspace with contactfpga_msgs

"No data" is never "no contact": `/stop` is also True before the first frame. What moves the robot must stop on True,
and when `/stop` itself does not arrive. After a contact or a fault it stays True until this node starts again.
"""

import time

import rclpy
from contactfpga_msgs.msg import Zones
from rclpy.node import Node
from rclpy.qos import QoSProfile, ReliabilityPolicy
from std_msgs.msg import Bool

PERIOD_S = 0.01
"""From one message to the next."""

SILENCE_S = 0.05
"""The oldest that the newest frame may be."""

NEWEST = QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT)
"""Only the newest frame: a queue of old ones would delay the stop."""


class Stop(Node):
    """Listens to `/skin/zones`, and publishes `/stop` at once on contact, otherwise every PERIOD_S."""

    def __init__(self):
        super().__init__("stop")
        self.reason = ""
        self.heard_s = float("-inf")
        self.stop = self.create_publisher(Bool, "/stop", 10)
        self.create_subscription(Zones, "/skin/zones", self.on_zones, NEWEST)
        self.create_timer(PERIOD_S, self.publish)

    def on_zones(self, message):
        """Take a frame."""
        self.heard_s = time.monotonic()
        fault = message.faults or message.flags & (Zones.FLAG_FAULT | Zones.FLAG_MISMATCH)
        if not self.reason and (fault or message.pressed or message.flags & Zones.FLAG_MOTION):
            self.reason = "fault" if fault else "contact"
            self.get_logger().info(f"stop: {self.reason}")
            self.publish()

    def publish(self):
        """Say whether to stop."""
        silent = time.monotonic() - self.heard_s > SILENCE_S
        self.stop.publish(Bool(data=silent or bool(self.reason)))


if __name__ == "__main__":
    rclpy.init()
    rclpy.spin(Stop())
