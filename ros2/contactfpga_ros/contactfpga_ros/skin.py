"""A lifecycle node that publishes what a board says: `ros2 run contactfpga_ros skin`.

What is published, and when, is decided by contactfpga.robot.ros.feed, which hands over messages as bytes; without ROS,
`contactfpga ros` publishes the same.
"""

from __future__ import annotations

import importlib
import signal
import threading
from typing import Any

import rclpy
from rcl_interfaces.msg import ParameterDescriptor
from rclpy.lifecycle import Node, State, TransitionCallbackReturn
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rclpy.signals import SignalHandlerOptions

from contactfpga import ContactFPGAError
from contactfpga import open as open_board
from contactfpga.driver.driver import Board
from contactfpga.robot.haptics import WithReadings
from contactfpga.robot.ros import convert
from contactfpga.robot.ros.cdr import encode
from contactfpga.robot.ros.feed import Feed, lost_board
from contactfpga.robot.ros.settings import TOPICS, Settings, Topic
from contactfpga.tools.console.forces import Forces

AUTOSTART = "Configure and activate without being asked. Turn it off for a lifecycle manager."
SETTINGS = {
    "frame": "Name of the link's frame. Empty: the board's name, or skin.",
    "parent": "Frame in which the link's frame is published on /tf_static. Empty: it is not.",
    "place_m": "Where the link's frame lies in its parent, in m.",
    "turn_rad": "How it is turned, in rad, about the fixed x, y and z axes in turn.",
    "zones_hz": "Zones, tracks and contacts at most as often. A frame with another number of zones always goes out.",
    "markers_hz": "Markers as often.",
    "diagnostics_hz": "Diagnostics as often.",
    "silence_s": "After this time without a frame diagnostics report an error, in s.",
}
CONNECTION = {
    "port": ("", "Serial port, sim:// or replay://FILE. Empty: the one supported board that is plugged in."),
    "skin": ("", "TOML file of the Skin that the board must have. Empty: any."),
    "units": ("", "TOML file of the board's pressure units, for forces. Empty: none."),
    "friction": (0.5, "Of what touches: force along the surface over the push at most."),
    "retry_s": (1.0, "Time between two attempts to open the port, in s."),
}


class Skin(Node):
    """Unconfigured: parameters may change. Inactive: they are checked. Active: the port is open, topics speak."""

    def __init__(self) -> None:
        super().__init__("skin")
        self.declare_parameter("autostart", True, ParameterDescriptor(description=AUTOSTART))
        for name, text in SETTINGS.items():
            usual = getattr(Settings(), name)
            value = list(usual) if isinstance(usual, tuple) else usual
            self.declare_parameter(name, value, ParameterDescriptor(description=text))
        for name, (value, text) in CONNECTION.items():
            self.declare_parameter(name, value, ParameterDescriptor(description=text))
        self._settings = Settings()
        self._speakers: dict[str, Any] = {}
        self._stop = threading.Event()
        self._thread: threading.Thread | None = None

    def _value(self, name: str):
        value = self.get_parameter(name).value
        return value if isinstance(value, (str, bool, int, float)) else tuple(value)

    # ---- transitions

    def on_configure(self, state: State) -> TransitionCallbackReturn:
        try:
            self._settings = Settings(**{name: self._value(name) for name in SETTINGS})
        except ValueError as error:
            self.get_logger().error(str(error))
            return TransitionCallbackReturn.FAILURE
        self._speakers = {name: self._speaker(topic) for name, topic in TOPICS.items()}
        return TransitionCallbackReturn.SUCCESS

    def on_activate(self, state: State) -> TransitionCallbackReturn:
        result = super().on_activate(state)
        self._stop.clear()
        self._thread = threading.Thread(target=self._work, name="skin", daemon=True)
        self._thread.start()
        return result

    def on_deactivate(self, state: State) -> TransitionCallbackReturn:
        self._end()
        return super().on_deactivate(state)

    def on_cleanup(self, state: State) -> TransitionCallbackReturn:
        self.close()
        return TransitionCallbackReturn.SUCCESS

    def on_shutdown(self, state: State) -> TransitionCallbackReturn:
        return self.on_cleanup(state)

    def close(self) -> None:
        """Give the port back and end all topics."""
        self._end()
        for speaker in self._speakers.values():
            self.destroy_lifecycle_publisher(speaker)
        self._speakers = {}

    def _speaker(self, topic: Topic):
        package, _, short = topic.type.partition("/")
        qos = QoSProfile(
            depth=topic.depth,
            reliability=ReliabilityPolicy.RELIABLE,
            durability=DurabilityPolicy.TRANSIENT_LOCAL if topic.latched else DurabilityPolicy.VOLATILE,
        )
        kind = getattr(importlib.import_module(f"{package}.msg"), short)
        name = topic.name if topic.name.startswith("/") else f"~/{topic.name}"
        return self.create_lifecycle_publisher(kind, name, qos)

    # ---- the thread that reads the board

    def _work(self) -> None:
        while not self._stop.is_set():
            try:
                self._publish()
            except (ContactFPGAError, OSError, ValueError) as error:
                self._lost(str(error))
                self._stop.wait(self._value("retry_s"))
            else:
                return  # asked to stop, or a recording ended

    def _publish(self) -> None:
        with open_board(self._value("port") or None, self._value("skin") or None) as board:
            self.get_logger().info(f"publishing the skin on {board.port}")
            forces = Forces.of(board, self._value("units") or None, self._value("friction"))
            source: Board | WithReadings = board if forces is None else WithReadings(board)
            felt = None if forces is None else forces.of_frame
            Feed(board, self._send, self._settings, felt, self._now_ns).run(source, self._stop.is_set)

    def _lost(self, why: str) -> None:
        self.get_logger().error(why, throttle_duration_sec=10.0)
        name = self._settings.frame or "skin"
        message = lost_board(name, why, convert.header(self._now_ns(), ""))
        self._send("/diagnostics", encode(TOPICS["/diagnostics"].type, message))

    def _send(self, topic: str, data: bytes) -> None:
        self._speakers[topic].publish(data)

    def _now_ns(self) -> int:
        return self.get_clock().now().nanoseconds

    def _end(self) -> None:
        self._stop.set()
        if self._thread is not None:
            self._thread.join()
            self._thread = None


def main() -> None:
    """Run the node until it is told to end."""
    # With rclpy's own handlers nothing could be published any more while the thread of the board still does.
    ended: list[int] = []  # and no Event, whose lock the handler of a second signal would wait for
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda number, _: ended.append(number))
    rclpy.init(signal_handler_options=SignalHandlerOptions.NO)
    node = Skin()
    if node.get_parameter("autostart").value and node.trigger_configure() == TransitionCallbackReturn.SUCCESS:
        node.trigger_activate()
    while not ended:
        rclpy.spin_once(node, timeout_sec=0.2)
    node.close()
    node.destroy_node()
    rclpy.try_shutdown()


if __name__ == "__main__":
    main()
