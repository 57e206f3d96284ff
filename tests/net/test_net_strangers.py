"""Whatever others send under a key, reader and publisher go on; other users are kept out."""

import os
import stat
import sys
import tempfile
from pathlib import Path

import pytest
from fake_board import FakeBoard, wait_until
from net_processes import Streaming, patient, publish, router

import contactfpga
from contactfpga.robot.net import session
from contactfpga.robot.net.message import Message
from contactfpga.robot.net.session import own_endpoint
from contactfpga.tools import cli

pytest.importorskip("zenoh")
pytestmark = pytest.mark.usefixtures("_closed_ports")

SKIN = contactfpga.Skin(name="left forearm")
KEY = "contactfpga/left-forearm"
LONG = 60.0


def first_message(network):
    """One that the publisher sends."""
    found = []
    subscriber = network.declare_subscriber(f"{KEY}/bytes", lambda one: found.append(one.payload.to_bytes()))
    wait_until(lambda: found)
    subscriber.undeclare()
    return Message.decode(found[0])


def test_a_forged_token_keeps_no_publisher_from_starting(endpoint):
    """test_net_port.py has that it hides no death."""
    with Streaming(SKIN) as board, router(endpoint), session.connected(endpoint) as stranger:
        stranger.liveliness().declare_token(f"{KEY}/alive/00000000deadbeef")
        with publish(board.path, "--connect", endpoint) as publisher:
            assert publisher.line.startswith("zenoh://"), publisher.end()
            number = first_message(stranger).publisher
            stranger.liveliness().declare_token(f"{KEY}/alive/{number:016x}")
            with contactfpga.open(patient(publisher.line), timeout=LONG) as reader:
                assert reader.read(LONG)


# ---- the Unix socket that is the default


@pytest.fixture
def runtime(monkeypatch):
    """The user's folder for sockets: a socket's path is short, and pytest's folders are long."""
    with tempfile.TemporaryDirectory(dir="/tmp") as folder:
        monkeypatch.setenv("XDG_RUNTIME_DIR", folder)
        yield Path(folder)


def test_by_default_a_board_is_read_through_a_socket_in_a_folder_of_this_user_alone(runtime, python):
    with Streaming(SKIN) as board, publish(board.path) as publisher:
        assert publisher.line == f"zenoh://{KEY}"
        folder = runtime / "contactfpga"
        assert stat.S_IMODE(folder.stat().st_mode) == 0o700
        psutil = pytest.importorskip("psutil")
        assert psutil.Process(publisher.process.pid).net_connections("inet") == []
        with contactfpga.open(patient(publisher.line), timeout=LONG) as reader:
            assert reader.read(LONG).time_us in board.sent_us
        if os.getuid() == 0:
            connect = f"socket.socket(socket.AF_UNIX).connect({str(folder / 'zenoh.sock')!r})"
            for other, said in ((0, ""), (65534, "PermissionError")):
                script = f"import os, socket; os.setgroups([]); os.setuid({other}); {connect}"
                found = python(script)
                assert said in found.stderr
                assert bool(said) == bool(found.returncode)


def test_a_socket_that_a_killed_publisher_left_is_taken_over_and_a_second_publisher_is_told_where(runtime, capsys):
    with Streaming(SKIN) as board, publish(board.path) as publisher:
        with FakeBoard(contactfpga.Skin(name="chest")) as other:
            assert cli.main(["publish", other.path, "--timeout", "60"]) == 1
            said = capsys.readouterr().err
            assert said.endswith(f"connect to the publisher that listens there: --connect {own_endpoint()}\n")
            with publish(other.path, "--connect", own_endpoint()) as second:
                with contactfpga.open(patient("zenoh://contactfpga/chest"), timeout=LONG) as reader:
                    assert reader.name == "chest"
                assert second.line.startswith("zenoh://contactfpga/chest?connect=unixsock-stream/")
        publisher.end()
        assert (runtime / "contactfpga" / "zenoh.sock").exists()
        with publish(board.path) as again, contactfpga.open(patient(again.line), timeout=LONG) as reader:
            assert reader.read(LONG)


def test_a_folder_that_others_can_open_or_replace_is_not_used(runtime, monkeypatch):
    folder = runtime / "contactfpga"

    def refused():
        with pytest.raises(contactfpga.ContactFPGAError, match=r"; .*name an endpoint, for instance tcp/127") as caught:
            own_endpoint()
        return str(caught.value)

    alone = "is not a folder that only you can open or replace; remove it, or "
    folder.mkdir(0o755)
    assert alone in refused()
    folder.rmdir()
    (runtime / "real").mkdir(0o700)
    folder.symlink_to(runtime / "real")
    assert alone in refused()
    folder.unlink()
    folder.write_text("")
    assert alone in refused()
    folder.unlink()
    runtime.chmod(0o777)
    assert alone in refused()
    runtime.chmod(0o1777)
    assert own_endpoint() == f"unixsock-stream/{folder}/zenoh.sock"
    if os.getuid() == 0:
        os.chown(folder, 65534, 65534)
        assert alone in refused()
    for long in (runtime / ("x" * 100), runtime / "a?b"):
        monkeypatch.setenv("XDG_RUNTIME_DIR", str(long))
        assert "a socket's path has at most 100 bytes" in refused()
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(runtime / "nowhere"))
    assert "cannot be made for the socket: No such file or directory" in refused()


def test_without_a_folder_of_the_session_the_socket_lies_in_that_for_temporary_files(tmp_path, monkeypatch):
    monkeypatch.delenv("XDG_RUNTIME_DIR", raising=False)
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    assert own_endpoint() == f"unixsock-stream/{tmp_path}/contactfpga-{os.getuid()}/zenoh.sock"


def test_windows_has_loopback(monkeypatch):
    monkeypatch.setattr(sys, "platform", "win32")
    assert own_endpoint() == "tcp/127.0.0.1:7447"
