"""Boards over Zenoh, in processes of their own: what fails is reported or counted, and nothing wrong is delivered."""

import collections
import itertools
import os
import signal
import threading
from pathlib import Path

import pytest
from fake_board import FakeBoard, background, wait_until
from net_processes import Streaming, assert_loopback_alone, free_endpoint, patient, publish, router

import contactfpga
from contactfpga.robot.net import session
from contactfpga.tools import cli
from contactfpga.tools.commands import publish as command
from contactfpga.tools.console import interrupt

psutil = pytest.importorskip("psutil")
pytest.importorskip("zenoh")
pytestmark = pytest.mark.usefixtures("_closed_ports")

SKIN = contactfpga.Skin(name="left forearm")
LONG = 60.0


@pytest.fixture
def streaming():
    with Streaming(SKIN) as board:
        yield board


def port(endpoint, wait_s=None):
    return f"zenoh://contactfpga/left-forearm?connect={endpoint}" + (f"&wait={wait_s}" if wait_s is not None else "")


def take(board, count, sent_us):
    """The next ``count`` frames are frames that the board sent, in order."""
    times = [board.next(LONG).time_us for _ in range(count)]
    assert set(times) <= sent_us
    assert times == sorted(set(times))


def test_a_published_board_is_a_board(streaming, endpoint):
    with publish(streaming.path, "--listen", endpoint) as publisher:
        assert publisher.line == port(endpoint)
        streaming.waits = True
        with contactfpga.open(patient(publisher.line), SKIN, timeout=LONG) as board:
            assert board.name == "left forearm"
            before = board.clock()
            zones = board.read(LONG)
            assert zones.arrived_s > before
            assert zones[0].area_cells == 4
            take(board, 50, streaming.sent_us)
            with contactfpga.open(patient(publisher.line), timeout=LONG) as second:
                assert second.read(LONG) is not None
            wait_until(lambda: board.stats.net.messages > 5)
            stats = board.stats.to_dict()
        assert (stats["lost"], stats["damaged"], stats["net"]["lost_messages"]) == (0, {}, 0)
        assert_loopback_alone(publisher.process.pid)
        publisher.process.send_signal(signal.SIGINT)
        assert publisher.process.wait(LONG) == 0
        assert publisher.end() == ""


def assert_given_back(pid, path):
    """Else a board that is plugged in again would get another name."""
    held = Path(f"/proc/{pid}/fd")
    if held.is_dir():
        wait_until(lambda: path not in {os.readlink(one).removesuffix(" (deleted)") for one in held.iterdir()})


def test_one_publisher_has_several_boards_and_goes_on_when_one_is_gone(streaming, endpoint):
    other = FakeBoard(contactfpga.Skin(name="chest", rows=9))
    with other, publish(streaming.path, "--listen", endpoint, others=[other.path]) as publisher:
        lines = [publisher.line, publisher.process.stdout.readline().strip()]
        assert lines == [port(endpoint), f"zenoh://contactfpga/chest?connect={endpoint}"]
        with (
            contactfpga.open(patient(lines[0]), timeout=LONG) as board,
            contactfpga.open(lines[1], timeout=LONG) as chest,
        ):
            assert chest.sheet.rows == 9
            other.unplug()
            assert "is gone" in (said := publisher.process.stderr.readline())
            assert said.endswith("; the others go on\n")
            assert_given_back(publisher.process.pid, other.path)
            with pytest.raises(contactfpga.PortLost):
                collections.deque((chest.next(LONG) for _ in itertools.count()), maxlen=0)
            take(board, 20, streaming.sent_us)
        publisher.process.send_signal(signal.SIGINT)
        assert publisher.process.wait(LONG) == 1


def test_boards_that_go_together_are_reported_together(capsys, monkeypatch):
    """As the sheets of one FPGA do, which share what became of their port."""
    monkeypatch.setattr(command, "SHOWN_S", 0.5)
    of_both, of_one = contactfpga.PortLost("A is gone"), contactfpga.PortLost("B is gone")
    closed = []

    class Gone:
        def __init__(self, failure, together):
            self.failure, self.together, self.close = failure, together, lambda: closed.append(self)

        def run(self, stop):
            self.together.wait(LONG)
            if self.failure is None:
                stop.wait(LONG)
            else:
                raise self.failure

    def publish_all(*failures):
        together = threading.Barrier(len(failures))
        gone = [Gone(failure, together) for failure in failures]
        assert command._publish(dict(zip(gone, gone))) == 1
        return capsys.readouterr().err

    assert publish_all(of_both, of_both) == "contactfpga: A is gone\n"
    said = publish_all(of_both, of_both, of_one).splitlines()
    assert sorted(said) == ["contactfpga: A is gone", "contactfpga: B is gone"]
    failed, tell = threading.Event(), interrupt.failed
    monkeypatch.setattr(interrupt, "failed", lambda reason: (tell(reason), failed.set()))
    with interrupt._listening(), background(lambda: failed.wait(LONG) and signal.raise_signal(signal.SIGINT)):
        said = publish_all(of_both, None)
    assert said == "contactfpga: A is gone; the others go on\n"
    assert len(closed) == 7


def test_a_port_that_is_named_twice_is_reported_as_that(streaming, tmp_path, capsys):
    (link := tmp_path / "left").symlink_to(streaming.path)
    for again in (streaming.path, link):
        assert cli.main(["publish", streaming.path, str(again), "--timeout", "60"]) == 1
        said = f"contactfpga: {again} is the port {streaming.path}, which is named already; name it once\n"
        assert capsys.readouterr().err == said


def test_a_port_that_is_taken_and_other_mistakes_are_one_line(streaming, capsys, endpoint, monkeypatch):
    with router(endpoint):
        assert cli.main(["publish", streaming.path, "--listen", endpoint, "--timeout", "60"]) == 1
    errors = capsys.readouterr().err
    assert "cannot listen there" in errors
    assert f"--connect {endpoint}" in errors
    assert ".cargo" not in errors
    assert errors.count("\n") == 1
    for arguments, said in (
        (["replay://x"], "publish a board, not a recording or what is published already"),
        ([streaming.path, "--key", "a/**"], "key is 'a/**'"),
        ([streaming.path, "/dev/null", "--key", "a"], "--key a names one board, and there are 2; leave it out"),
        ([streaming.path, "--listen", "x", "--connect", "y"], "give --listen or --connect, not both"),
        ([streaming.path, "--config", "/nowhere.json5"], "there is no such file"),
    ):
        assert cli.main(["publish", *arguments]) != 0
        assert said in capsys.readouterr().err
    monkeypatch.setattr(session, "CONNECT_MS", 600)
    with pytest.raises(contactfpga.PortNotFound, match=r"cannot connect there.*is `contactfpga publish` running there"):
        contactfpga.open(port(free_endpoint()))


@pytest.mark.parametrize("opened", [session.listening, session.connected])
def test_an_endpoint_that_zenoh_cannot_read_is_one_line(opened):
    says = r"^endpoint 'nowhere': Endpoints must be of the form [^{}]*; for instance tcp/127\.0\.0\.1:7447$"
    with pytest.raises(contactfpga.ContactFPGAError, match=says):
        opened("nowhere")
