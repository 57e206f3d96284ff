"""A node that real ROS runs: `ros_listener.py SECONDS [TRANSITION@SECOND]...` listens for so long to all topics, has
the node skin make transitions of its lifecycle meanwhile, and prints what came as JSON."""

import importlib
import json
import sys
import time

import rclpy
from lifecycle_msgs.srv import ChangeState, GetState
from rclpy.executors import SingleThreadedExecutor
from rclpy.qos import DurabilityPolicy, QoSProfile

TOPICS = {
    "/skin/skin": "contactfpga_msgs/Skin",
    "/skin/zones": "contactfpga_msgs/Zones",
    "/skin/tracks": "contactfpga_msgs/Tracks",
    "/skin/contacts": "contactfpga_msgs/Contacts",
    "/skin/markers": "visualization_msgs/MarkerArray",
    "/tf_static": "tf2_msgs/TFMessage",
    "/diagnostics": "diagnostic_msgs/DiagnosticArray",
}
LATCHED = {"/skin/skin", "/tf_static"}


def plain(value):
    """A message in what JSON can hold."""
    if hasattr(value, "get_fields_and_field_types"):
        return {name: plain(getattr(value, name)) for name in value.get_fields_and_field_types()}
    if isinstance(value, bytes):
        return list(value)
    if isinstance(value, (str, int, float, bool)):
        return value
    if hasattr(value, "tolist"):  # numpy's
        return value.tolist()
    return [plain(one) for one in value]


class Listener:
    """What came, by topic: how many, the first and the last, when they came, and how late."""

    def __init__(self):
        self.node = rclpy.create_node("listener")
        self.executor = SingleThreadedExecutor()  # that of rclpy.spin_once takes the node in and out each time
        self.executor.add_node(self.node)
        self.begun = time.monotonic()
        self.came = {}
        for topic, kind in TOPICS.items():
            package, short = kind.split("/")
            made = getattr(importlib.import_module(f"{package}.msg"), short)
            kept = DurabilityPolicy.TRANSIENT_LOCAL if topic in LATCHED else DurabilityPolicy.VOLATILE
            qos = QoSProfile(depth=1000, durability=kept)
            self.node.create_subscription(made, topic, lambda message, topic=topic: self.take(topic, message), qos)

    def take(self, topic, message):
        found = self.came.setdefault(topic, {"count": 0, "first": plain(message), "at_s": [], "late_ms": []})
        found["count"] += 1
        found["last"] = message
        found["at_s"].append(round(time.monotonic() - self.begun, 3))
        if hasattr(message, "header"):
            stamp = message.header.stamp
            found["late_ms"].append((time.time_ns() - stamp.sec * 1_000_000_000 - stamp.nanosec) / 1e6)

    def call(self, kind, name, request):
        """What a service of the node skin answers."""
        client = self.node.create_client(kind, f"/skin/{name}")
        if not client.wait_for_service(timeout_sec=10):
            raise SystemExit(f"/skin/{name} is not there")
        future = client.call_async(request)
        self.executor.spin_until_future_complete(future, timeout_sec=10)
        return future.result()

    def hashes(self):
        """Of each topic's publishers, as discovery reported them."""
        return {
            topic: sorted({str(found.topic_type_hash) for found in self.node.get_publishers_info_by_topic(topic)})
            for topic in TOPICS
        }


def main():
    rclpy.init()
    listener, states = Listener(), []
    orders = sorted((float(at), int(number)) for number, at in (order.split("@") for order in sys.argv[2:]))
    until = listener.begun + float(sys.argv[1])
    while time.monotonic() < until:
        listener.executor.spin_once(timeout_sec=0.05)
        if orders and time.monotonic() - listener.begun >= orders[0][0]:
            request = ChangeState.Request()
            request.transition.id = orders.pop(0)[1]
            done = listener.call(ChangeState, "change_state", request)
            states.append([done.success, listener.call(GetState, "get_state", GetState.Request()).current_state.label])
    hashes = listener.hashes()
    for found in listener.came.values():
        found["last"] = plain(found["last"])
    print(json.dumps({"came": listener.came, "hashes": hashes, "states": states}))


if __name__ == "__main__":
    main()
