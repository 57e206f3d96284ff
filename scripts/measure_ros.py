"""Prints the tables of docs/ros.md. Makes an environment with ROS 2 for each distribution where there is none
(scripts/ros_environment.py)."""

from __future__ import annotations

import contextlib
import json
import os
import statistics
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any

from ros_environment import DISTRIBUTIONS, ROOT, Environment

import contactfpga
from contactfpga.robot.ros import convert
from contactfpga.robot.ros.cdr import encode
from contactfpga.robot.ros.convert import markers, outline
from contactfpga.robot.ros.dds import Publisher
from contactfpga.robot.ros.settings import TOPICS
from contactfpga.robot.ros.types import type_hash
from contactfpga_sim.lab import writer

sys.path.append(str(ROOT / "tests" / "support"))

from ros_board import flowing
from tracker_frames import SKIN, frame

DOMAIN = 95
SECONDS = 15
HZ = 200.0
"""Zones per second: as many as a subscriber in Python takes at ease beside the other topics."""
ROUNDS = 3000
NOT_PUBLISHED = {"wrench"}
"""Without pressure units."""


HEAD = ("ROS 2", "published by", "topics read", "same type hashes", "zones per second", "late, median", "late, 99 %")


def shown_table() -> str:
    """What real nodes read."""
    rows: list[Sequence[str]] = [HEAD]
    for number, distribution in enumerate(DISTRIBUTIONS):
        ros, domain = Environment(distribution), DOMAIN + 2 * number
        ros.make()
        own = os.environ | {"PYTHONPATH": os.pathsep.join(path for path in sys.path if path)}
        command = [sys.executable, "-m", "contactfpga", "ros", "PORT", "--parent", "base", "--domain", domain]
        command += ["--zones-hz", HZ]
        node = [ros.python, "-m", "contactfpga_ros.skin", "--ros-args", "-p", "port:=PORT", "-p", "parent:=base"]
        node += ["-p", f"zones_hz:={HZ}"]
        rows.append((distribution.capitalize(), "`contactfpga ros`", *cells(heard(ros, command, own, domain))))
        rows.append(("", "the node", *cells(heard(ros, node, ros.variables(domain + 1), domain + 1))))
    return writer.table_of(rows)


def heard(ros: Environment, command: Sequence[object], variables: Mapping[str, str], domain: int) -> dict[str, Any]:
    """What a node heard of a board while the command published it."""
    listener = [str(ros.python), str(ROOT / "tests" / "support" / "ros_listener.py"), str(SECONDS)]
    quiet = {"capture_output": True, "text": True, "check": True, "timeout": 120}
    with flowing() as port:
        given = [str(word).replace("PORT", port) for word in command]
        with subprocess.Popen(given, env=dict(variables), stdout=subprocess.DEVNULL) as publisher:
            try:
                done = subprocess.run(listener, env=ros.variables(domain), **quiet)
            finally:
                publisher.terminate()
    return json.loads(done.stdout.splitlines()[-1])


def cells(found: Mapping[str, Any]) -> list[str]:
    """Of a table."""
    came, zones = found["came"], found["came"]["/skin/zones"]
    wanted = [topic for name, topic in TOPICS.items() if name not in NOT_PUBLISHED]
    names = [topic.resolved("skin") for topic in wanted]
    alike = sum(
        type_hash(topic.type)[7:] in "".join(found["hashes"][name]).lower() for topic, name in zip(wanted, names)
    )
    late, span_s = sorted(zones["late_ms"][len(zones["late_ms"]) // 3 :]), zones["at_s"][-1] - zones["at_s"][0]
    return [
        f"{len(set(names) & set(came))} of {len(names)}",
        f"{alike} of {len(names)}",
        f"{zones['count'] / span_s:.0f}",
        f"{statistics.median(late):.2f} ms",
        f"{late[len(late) * 99 // 100]:.2f} ms",
    ]


def costs_table() -> str:
    """Bytes and processor time of each message."""
    head = convert.header(time.time_ns(), "forearm")
    tracker = contactfpga.Tracker()
    zones, tracks = frame(0, [(3, 4)]), tracker.update(frame(0, [(3, 4)]))
    rim = outline(SKIN.sheet)
    makers: dict[str, Callable[[], dict]] = {
        "zones": lambda: convert.zones(zones, head),
        "tracks": lambda: convert.tracks(tracks, (), False, head),
        "contacts": lambda: convert.contacts(tracks.active, head),
        "markers": lambda: markers(rim, tracks.active, head),
    }
    rows = [["message", "bytes", "to make, µs", "to publish, µs"]]
    domain = DOMAIN + 7
    with Publisher("skin", domain) as publisher, subscribed(publisher, list(makers), domain):
        for name, make in makers.items():
            kind = TOPICS[name].type
            data = encode(kind, make())
            made = spent_us(lambda make=make, kind=kind: encode(kind, make()))
            sent = spent_us(lambda name=name, data=data: publisher.send(name, data))
            rows.append([f"`{kind.partition('/')[2]}`", f"{len(data):,}", f"{made:.0f}", f"{sent:.0f}"])
    return writer.table_of(rows)


SUBSCRIBER = """
import sys, time
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic
from contactfpga.robot.ros import dds
from contactfpga.robot.ros.settings import TOPICS
publisher = dds.Publisher("skin", int(sys.argv[1]))
joined, readers = publisher._participant, []
for name in sys.argv[2:]:
    kind = dds.idl_type(TOPICS[name].type)
    topic = Topic(joined, f"rt{publisher.topic(name)}", kind)
    readers.append(DataReader(joined, topic, qos=dds.qos_of(TOPICS[name])))
while True:
    time.sleep(0.01)
    for reader in readers:
        reader.take(1000)
"""


@contextlib.contextmanager
def subscribed(publisher: Publisher, names: Sequence[str], domain: int) -> Iterator[None]:
    """Another process takes these topics, so that they are sent."""
    own = os.environ | {"PYTHONPATH": os.pathsep.join(path for path in sys.path if path)}
    with subprocess.Popen([sys.executable, "-c", SUBSCRIBER, str(domain), *names], env=own) as reader:
        try:
            while not all(publisher.subscribers(name) for name in names):
                time.sleep(0.05)
            yield
        finally:
            reader.terminate()


def spent_us(action: Callable[[], object]) -> float:
    """Processor time of this thread in us, the least of some rounds."""
    found = []
    for _ in range(5):
        begun = time.thread_time()
        for _ in range(ROUNDS // 5):
            action()
        found.append((time.thread_time() - begun) / (ROUNDS // 5) * 1e6)
    return min(found)


if __name__ == "__main__":
    print(shown_table(), costs_table(), sep="\n\n")
