"""A FlexiTac sheet whose line loses and changes bytes, by the ways a user takes: commands, recordings, the network,
ROS 2 and the view."""

import collections
import json
import termios
import time

import numpy as np
import pytest
from fake_board import patiently, wait_until

import contactfpga
from contactfpga_sim.model.board.flexitac import COLUMNS, ROWS, FlexitacSheet

ROW, COLUMN, PITCH_MM = 6, 20, 3.0
PLACE_MM = COLUMN * PITCH_MM, ROW * PITCH_MM
CELLS = 13
"""Of a disc of radius 2 cells."""


def touched(seconds):
    """The force of a disc on a cell, from 1 s after somebody began to read."""
    rows, columns = np.mgrid[:ROWS, :COLUMNS]
    return ((rows - ROW) ** 2 + (columns - COLUMN) ** 2 <= 4) * float(seconds > 1.0)


class Sheet(FlexitacSheet):
    """One that a test can begin again with."""

    def begin(self):
        """As if nobody had read yet: what was sent is dropped, and then some more."""
        self.seconds = 0.0
        wait_until(lambda: termios.tcflush(self._slave, termios.TCIFLUSH) or self.seconds > 0.1)


@pytest.fixture
def sheet():
    """Of 514 bytes of a frame, one is lost in one of 6 frames, and one is wrong in one of 10."""
    with Sheet(touched, lost=1 / 3000, wrong=1 / 5000) as sheet:
        yield sheet


@pytest.fixture
def address(sheet):
    return f"flexitac://{sheet.port}?frames=10"


def usual(frames):
    """The zone that most frames with any have: its x and y in mm, and its cells. Frames: lists of these."""
    ((zone, times),) = collections.Counter(zone for zones in frames for zone in zones).most_common(1)
    assert times > 0.7 * sum(map(bool, frames))  # a wrong byte may change a cell of a frame
    return zone


def of_json(text):
    """Frames of ``zones --json``, as :func:`usual` takes them."""
    lines = [json.loads(line) for line in text.splitlines()]
    return [[(zone["x_mm"], zone["y_mm"], zone["area_cells"]) for zone in line["zones"]] for line in lines]


def for_seconds(run, sheet, *words, recorded=None):
    """Output of a command that runs for some seconds and may record into a file; it runs for longer where the machine
    lets the sheet wait."""

    def said(seconds):
        sheet.begin()
        if recorded is not None:
            recorded.unlink(missing_ok=True)
        status, said, errors = run(*words, "--timeout", "60", "--seconds", seconds)
        assert status == 0, errors
        return said

    return patiently(said, lambda said: sum(map(bool, of_json(said))) > 100, (3, 12, 60))


def test_zones_and_tracks_by_command(address, sheet, run):
    said = for_seconds(run, sheet, "zones", address, "--tracks", "--json")
    assert usual(of_json(said)) == (*PLACE_MM, CELLS)
    ids = [track["id"] for line in map(json.loads, said.splitlines()) for track in line["tracks"]]
    assert collections.Counter(ids).most_common(1)[0][1] > 60


def test_a_recording_by_command_is_shown_again(address, sheet, run, tmp_path):
    file = tmp_path / "flexitac.rec"
    said = for_seconds(run, sheet, "zones", address, "--json", "--record", file, recorded=file)
    status, again, errors = run("zones", f"replay://{file}", "--json")
    assert status == 0, errors
    seen = {frame["time_us"]: frame["zones"] for frame in map(json.loads, said.splitlines())}
    kept = {frame["time_us"]: frame["zones"] for frame in map(json.loads, again.splitlines())}
    assert seen.items() <= kept.items()
    assert usual(of_json(again)) == (*PLACE_MM, CELLS)


def test_recorded_as_mcap_and_exported(address, sheet, run, tmp_path):
    pytest.importorskip("mcap")

    def exported(seconds):
        sheet.begin()
        file, table = tmp_path / f"{seconds}.mcap", tmp_path / f"{seconds}.csv"
        status, _, errors = run("record", file, address, "--timeout", "60", "--seconds", seconds)
        assert status == 0, errors
        status, _, errors = run("export", file, table)
        assert status == 0, errors
        rows = [line.split(",") for line in table.read_text().splitlines()]
        at = [rows[0].index(name) for name in ("x_mm", "y_mm", "area_cells")]
        zones = [tuple(float(row[column]) for column in at) for row in rows[1:]]
        return [[zone] for zone in zones if zone[2]]

    found = patiently(exported, lambda found: len(found) > 100, (3, 12, 60))
    assert usual(found) == (*PLACE_MM, CELLS)


def zones_of(board, count):
    """Frames of the board until ``count`` of them are touched, as :func:`usual` takes them."""
    found = []
    while sum(map(bool, found)) < count:
        found.append([(zone.x_mm, zone.y_mm, zone.area_cells) for zone in board.next(60.0)])
    return found


def test_over_the_network(address, monkeypatch):
    pytest.importorskip("zenoh")
    from net_processes import free_endpoint, patient, publish, wait_long

    wait_long(monkeypatch)
    with publish(address, "--listen", free_endpoint()) as publisher:
        assert publisher.line.startswith("zenoh://"), publisher.end()
        with contactfpga.open(patient(publisher.line), timeout=60.0) as board:
            assert (board.sheet.rows, board.sheet.columns, board.sheet.pitch_x_mm) == (ROWS, COLUMNS, PITCH_MM)
            board.next(60.0)
            assert usual(zones_of(board, 100)) == (*PLACE_MM, CELLS)
            assert sum(board.stats.damaged.values()) > 3


def test_as_ros_topics(address):
    pytest.importorskip("cyclonedds")
    from cyclonedds.sub import DataReader
    from cyclonedds.topic import Topic
    from net_processes import Child

    from contactfpga.robot.ros import dds
    from contactfpga.robot.ros.settings import TOPICS

    domain, topic, found = 86, TOPICS["zones"], []  # a domain of this test alone
    with dds.Publisher("other", domain) as other:  # a participant that finds those on this computer
        named = Topic(other._participant, "rt/tactile/zones", dds.idl_type(topic.type))
        reader = DataReader(other._participant, named, qos=dds.qos_of(topic))
        with Child("-m", "contactfpga", "ros", address, "--domain", domain, "--namespace", "tactile") as command:
            assert "publishing /tactile/zones" in command.line, command.end()
            until = time.monotonic() + 100
            while sum(bool(each.zones) for each in found) < 100 and time.monotonic() < until:
                found += reader.take(100)
                time.sleep(0.01)
    zones = [[(round(1e3 * one.x, 3), round(1e3 * one.y, 3), one.area_cells) for one in each.zones] for each in found]
    assert usual(zones) == (*PLACE_MM, CELLS)


def test_in_the_view(address):
    pytest.importorskip("viser")
    pytest.importorskip("websockets")
    from viewed import Page, camera

    from contactfpga.tools.view import opening
    from contactfpga_sim.lab.view.browser import running

    with opening.opened(opening.ViewRequest(address, timeout=60.0), http_port=0) as shown, running(shown):
        assert shown.hand is None, "nobody presses a real sheet with the mouse"
        with Page(shown.web.get_port(), shown.guard) as page:
            page.hear(lambda message: message["type"] == "ReplayDoneMessage")
            page.say(camera((0.05, 0.02, 1.0)))
            drawn = [_barycenters(page) for _ in range(10)]
    wanted = tuple(np.float32(mm / 1000) for mm in PLACE_MM)
    assert any(any(np.allclose(one[:2], wanted, atol=1e-6) for one in each) for each in drawn)


def _barycenters(page):
    """(n, 3) in m: the next that are drawn."""
    message = page.hear(lambda one: one.get("name") == "/sheet/barycenters" and one.get("props", {}).get("points"))
    return np.frombuffer(message["props"]["points"], np.float32).reshape(-1, 3)
