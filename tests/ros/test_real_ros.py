"""Real nodes of ROS 2 read what we publish, with and without ROS. The environment is made once, which downloads 260 MB
for each distribution and takes minutes; see scripts/ros_environment.py."""

import contextlib
import itertools
import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from ros_board import SKIN, flowing
from ros_environment import DISTRIBUTIONS, Environment

from contactfpga.robot.ros.settings import TOPICS
from contactfpga.robot.ros.types import type_hash

pytestmark = [pytest.mark.campaign, pytest.mark.timeout(3600)]

ROOT = Path(__file__).resolve().parents[2]
LISTENER = ROOT / "tests" / "support" / "ros_listener.py"
DOMAINS = {"jazzy": 91, "kilted": 92}
TRANSITIONS = {"configure": 1, "cleanup": 2, "activate": 3, "deactivate": 4}


@pytest.fixture(scope="module", params=DISTRIBUTIONS)
def ros(request):
    if not sys.platform.startswith("linux") or not shutil.which("cmake"):
        pytest.skip("wheels of ROS are for Linux, and cmake builds our messages")
    made = Environment(request.param)
    try:
        made.make()
    except subprocess.CalledProcessError as error:
        pytest.skip(f"no ROS {request.param}: {error}; {made.folder / 'log'} says why")
    return made


@pytest.fixture
def port():
    with flowing() as path:
        yield path


@contextlib.contextmanager
def running(command, variables):
    with subprocess.Popen(
        [*map(str, command)], env=variables, stdout=subprocess.PIPE, stderr=subprocess.STDOUT
    ) as done:
        try:
            yield done
        finally:
            done.terminate()
            said = done.communicate(timeout=30)[0].decode()
            print(said)  # shown where a test fails
    assert "Traceback" not in said


def heard(ros, domain, *orders, seconds=12):
    command = [ros.python, LISTENER, seconds, *orders]
    done = subprocess.run([*map(str, command)], env=ros.variables(domain), capture_output=True, text=True, timeout=250)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout.splitlines()[-1])


def check(found):
    """The zone of the board, 4 cells at column 2.5 and row 1.5, in every message that tells of it."""
    came = found["came"]
    assert set(came) == {"/skin/skin", "/skin/zones", "/skin/tracks", "/skin/contacts", "/skin/markers", "/tf_static",
                         "/diagnostics"}  # fmt: skip
    zones, (track,) = came["/skin/zones"], came["/skin/tracks"]["last"]["active"]
    (zone,), (contact,) = zones["last"]["zones"], came["/skin/contacts"]["last"]["contacts"]
    assert zones["count"] > 500
    assert zones["last"]["header"]["frame_id"] == "forearm"
    assert (zone["area_cells"], zone["sum_x"], zone["sum_y"], zone["x"], zone["y"]) == (4, 10, 6, 0.025, 0.015)
    assert contact["position"] == zone["position"] == {"x": 0.025, "y": 0.015, "z": 0.0}
    assert contact["name"] == f"forearm/{track['id']}"
    assert came["/skin/skin"]["last"]["fingerprint"] == list(SKIN.fingerprint)
    assert came["/tf_static"]["last"]["transforms"][0]["child_frame_id"] == "forearm"
    assert "contacts" in {marker["ns"] for marker in came["/skin/markers"]["last"]["markers"]}
    assert came["/diagnostics"]["last"]["status"][0]["hardware_id"] == SKIN.fingerprint.hex()


def test_ros_reads_what_we_publish_without_ros(ros, port):
    domain = DOMAINS[ros.distribution]
    variables = os.environ | {"PYTHONPATH": os.pathsep.join(str(ROOT / name) for name in ("py", "hdl", "sim"))}
    command = [sys.executable, "-m", "contactfpga", "ros", port, "--domain", domain, "--parent", "base"]
    with running(command, variables):
        found = heard(ros, domain)
    check(found)
    for topic in TOPICS.values():
        if topic.name != "wrench":
            (published,) = found["hashes"][topic.resolved("skin")]
            assert type_hash(topic.type).removeprefix("RIHS01_") in published.lower()


def test_the_node_publishes_and_follows_its_lifecycle(ros, port):
    domain = DOMAINS[ros.distribution] + 10
    command = [ros.python, "-m", "contactfpga_ros.skin", "--ros-args", "-p", f"port:={port}", "-p", "parent:=base"]
    orders = {6: "deactivate", 7: "cleanup", 8: "configure", 9: "activate"}
    with running(command, ros.variables(domain)):
        found = heard(ros, domain, *(f"{TRANSITIONS[name]}@{at}" for at, name in orders.items()), seconds=16)
    check(found)
    assert found["states"] == [[True, name] for name in ("inactive", "unconfigured", "inactive", "active")]
    at_s = found["came"]["/skin/zones"]["at_s"]
    assert max(after - before for before, after in itertools.pairwise(at_s)) > 1.5
    assert max(at_s) > 14


def test_the_node_says_that_no_board_is_there_and_goes_on_when_it_comes(ros, tmp_path):
    domain, link = DOMAINS[ros.distribution] + 20, tmp_path / "board"
    command = [ros.python, "-m", "contactfpga_ros.skin", "--ros-args", "-p", f"port:={link}", "-p", "retry_s:=0.2"]
    with running([*command, "-p", "parent:=base"], ros.variables(domain)):
        absent = heard(ros, domain, seconds=6)["came"]
        with flowing(link):
            check(heard(ros, domain))
    assert set(absent) == {"/diagnostics"}
    assert absent["/diagnostics"]["last"]["status"][0]["level"] == [2]


def test_the_node_refuses_parameters_that_cannot_be(ros):
    domain = DOMAINS[ros.distribution] + 30
    command = [ros.python, "-m", "contactfpga_ros.skin", "--ros-args", "-p", "zones_hz:=0.0"]
    with subprocess.Popen([*map(str, command)], env=ros.variables(domain), stderr=subprocess.PIPE, text=True) as node:
        try:
            assert "zones_hz is 0.0; it must be above 0 and at most 100000" in node.stderr.readline()
        finally:
            node.terminate()


def test_the_example_stops_on_contact(ros, port):
    domain = DOMAINS[ros.distribution] + 40
    publisher = [ros.python, "-m", "contactfpga_ros.skin", "--ros-args", "-p", f"port:={port}"]
    command = [*map(str, (ros.python, ROOT / "examples" / "ros_stop.py"))]
    with (
        running(publisher, ros.variables(domain)),
        subprocess.Popen(command, env=ros.variables(domain), stderr=subprocess.PIPE, text=True) as node,
    ):
        try:
            assert "stop: contact" in node.stderr.readline()
        finally:
            node.terminate()
