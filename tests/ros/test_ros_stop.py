"""The node of examples/ros_stop.py: `/stop` is True on contact, on a fault, on silence and before the first frame.

ROS is replaced by a stand-in that keeps what the node asks for; tests/ros/test_real_ros.py runs it in real ROS.
"""

import runpy
import sys
from types import ModuleType, SimpleNamespace

import pytest

import contactfpga

NAMES = ("rclpy", "rclpy.node", "rclpy.qos", "contactfpga_msgs", "contactfpga_msgs.msg", "std_msgs", "std_msgs.msg")
CLEAN = {"faults": [], "flags": 0, "pressed": 0}


class Node:
    """Of rclpy, as far as the example uses it."""

    def __init__(self, name):
        self.sent = []

    def create_publisher(self, kind, topic, depth):
        assert topic == "/stop"
        return SimpleNamespace(publish=lambda message: self.sent.append(message.data))

    def create_subscription(self, kind, topic, called, qos):
        assert (topic, qos.depth) == ("/skin/zones", 1)
        self.take = called

    def create_timer(self, period_s, called):
        self.tick = called

    def get_logger(self):
        return SimpleNamespace(info=lambda text: None)


@pytest.fixture
def node(monkeypatch):
    """The example's node; ``node.now_s`` is its clock."""
    for name in NAMES:
        monkeypatch.setitem(sys.modules, name, ModuleType(name))
    sys.modules["rclpy.node"].Node = Node
    sys.modules["rclpy.qos"].QoSProfile = SimpleNamespace
    sys.modules["rclpy.qos"].ReliabilityPolicy = SimpleNamespace(BEST_EFFORT=2)
    sys.modules["contactfpga_msgs.msg"].Zones = SimpleNamespace(FLAG_FAULT=4, FLAG_MISMATCH=2, FLAG_MOTION=8)
    sys.modules["std_msgs.msg"].Bool = SimpleNamespace
    made = runpy.run_path(str(contactfpga.examples() / "ros_stop.py"))["Stop"]
    node = made()
    node.now_s = 100.0
    monkeypatch.setitem(made.publish.__globals__, "time", SimpleNamespace(monotonic=lambda: node.now_s))
    return node


def heard(node, **values):
    """A frame comes; what the node has said last, after its timer's next call."""
    node.take(SimpleNamespace(**CLEAN | values))
    node.tick()
    return node.sent[-1]


def test_it_says_stop_until_a_frame_comes(node):
    node.tick()
    assert node.sent == [True]
    assert heard(node) is False


@pytest.mark.parametrize(
    "values", [{"pressed": 1}, {"flags": 2}, {"flags": 4}, {"flags": 8}, {"faults": ["row"]}], ids=str
)
def test_a_contact_and_a_fault_stop_at_once_and_for_good(node, values):
    assert heard(node) is False
    node.take(SimpleNamespace(**CLEAN | values))
    assert node.sent[1:] == [True]
    assert heard(node) is True


def test_flags_that_say_nothing_against_going_on_do_not_stop(node):
    assert heard(node, flags=1 | 16) is False


def test_silence_stops_it_until_frames_come_again(node):
    assert heard(node) is False
    node.now_s += 0.049
    node.tick()
    node.now_s += 0.002
    node.tick()
    assert node.sent[-2:] == [False, True]
    assert heard(node) is False
