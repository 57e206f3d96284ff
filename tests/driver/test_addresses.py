"""What `sim://` and `replay://` addresses mean, and what of foreign names a terminal gets to see."""

import os
import re

import numpy as np
import pytest
from slow_skin import SLOW

import contactfpga
from contactfpga.driver import recording
from contactfpga.driver.address import Sim, parse
from contactfpga.driver.finding import Candidate
from contactfpga.errors import AddressError, ContactFPGAError, PortNotFound
from contactfpga.inputs.values import visible
from contactfpga.tools import cli
from contactfpga_sim.model.board import native, webassembly
from contactfpga_sim.model.board.pty_board import PtyBoard


@pytest.mark.parametrize(
    ("address", "meant"),
    [
        ("sim://", Sim()),
        ("sim://?scene=palm&skin=a/b.toml", Sim("palm", "a/b.toml")),
        ("sim://?skin=a+b#c=d.toml", Sim(skin="a+b#c=d.toml")),
        ("sim://?skin=50%25%26more%2B.toml", Sim(skin="50%&more+.toml")),
        ("sim://?scene=a.npy&threshold=-1.5", Sim("a.npy", None, -1.5)),
        ("sim://?pace=0.5", Sim(pace=0.5)),
        ("sim://?unplug=0.5", Sim(unplug=(0, 0.5))),
        ("sim://?sheets=a.toml&unplug=1:0", Sim(sheets="a.toml", unplug=(1, 0.0))),
    ],
)
def test_an_address_has_one_reading(address, meant):
    assert parse(address) == meant


@pytest.mark.parametrize(
    ("address", "message"),
    [
        ("sim://?skin=a&b.toml", "'b.toml' is no option"),
        ("sim://?skin=100%.toml", "'%.t' is no % with two hex digits; a % that is meant is written %25, a & %26"),
        ("sim://?skin=%ff", "no UTF-8"),
        ("sim://?skin=a&skin=b", "skin is given twice"),
        ("sim://board?skin=a", "it reads sim://"),
        ("sim://?unplug=1:2", "unplug is '1:2'; it must be SECONDS, with 0 or more seconds"),
        ("sim://?sheets=a.toml&unplug=16:2", "unplug is '16:2'; it must be SHEET:SECONDS"),
        ("sim://?unplug=-1", "unplug is '-1'; it must be SECONDS"),
        ("sim://?pace=0", "pace is '0'; it must be a positive number up to 1e6, 1 for real time"),
    ],
)
def test_what_is_no_address_is_reported(address, message):
    with pytest.raises(AddressError) as caught:
        parse(address)
    assert message in str(caught.value)
    assert str(caught.value).startswith(address)


@pytest.mark.slow
def test_files_of_any_name_make_a_board(tmp_path):
    skin, scene = tmp_path / "50%&+#.toml", tmp_path / "a b%41.npy"
    skin.write_text(SLOW.to_toml())
    values = np.zeros((1, 4, 4), np.uint8)
    values[0, :2, 1] = 9, 8
    np.save(scene, values)
    quoted = [str(path).replace("%", "%25").replace("&", "%26") for path in (skin, scene)]
    with contactfpga.open(f"sim://?skin={quoted[0]}&scene={quoted[1]}&threshold=8") as board:
        assert board.next().pressed == 1
        assert board.skin == SLOW


@pytest.mark.parametrize("option", ["skin", "scene", "units", "sheets"])
def test_a_file_that_is_not_there_is_reported(option):
    address = f"sim://?{option}=nowhere.npy"
    says = f"{address} cannot be opened: nowhere.npy: No such file or directory; is the path right?"
    with pytest.raises(PortNotFound, match=f"^{re.escape(says)}$"):
        contactfpga.open(address)


@pytest.mark.parametrize("kind", ["fifo", "folder", "device"])
def test_only_files_are_replayed(tmp_path, kind):
    path = tmp_path / "x"
    {"fifo": os.mkfifo, "folder": os.mkdir, "device": lambda path: path.symlink_to("/dev/zero")}[kind](path)
    with pytest.raises(PortNotFound, match="not a regular file; is the path right"):
        contactfpga.open(f"replay://{path}")


@pytest.mark.parametrize("link", ["same", "symlink", "hard link"])
def test_a_recording_is_never_written_over(tmp_path, link):
    """Neither the one that is replayed nor any other."""
    path, other = tmp_path / "frames.bin", tmp_path / "other.bin"
    path.write_bytes(b"precious")
    if link == "same":
        other = path
    else:
        (other.symlink_to if link == "symlink" else other.hardlink_to)(path)
    for port in (f"replay://{path}", "sim://"):
        with pytest.raises(ContactFPGAError, match="is there already; name a new file, or remove it first"):
            contactfpga.open(port, record=other)
    assert path.read_bytes() == b"precious"
    (tmp_path / "empty.bin").touch()
    for name in ("new.bin", "empty.bin"):
        recording.create(tmp_path / name).close()


# ---- the link of `contactfpga board`


@pytest.mark.slow
@pytest.mark.parametrize("kind", [None, "file", "link", "folder"])
def test_the_link_is_removed_with_its_board_but_not_what_took_its_place(tmp_path, kind):
    link = tmp_path / "port"
    board = PtyBoard(SLOW, link=link)
    assert os.readlink(link) == board.port
    if kind:
        link.unlink()
        {"file": link.touch, "link": lambda: link.symlink_to("elsewhere"), "folder": link.mkdir}[kind]()
    board.stop()
    assert (link.is_symlink() or link.exists()) == bool(kind)


def test_a_link_that_leads_elsewhere_is_not_replaced(tmp_path):
    link = tmp_path / "port"
    link.symlink_to(tmp_path / "precious")
    with pytest.raises(ContactFPGAError, match=r"cannot link .*: File exists"):
        PtyBoard(SLOW, link=link)
    assert os.readlink(link) == str(tmp_path / "precious")


# ---- terminals


@pytest.mark.slow
def test_what_a_killed_board_left_is_replaced(tmp_path):
    link = tmp_path / "port"
    link.symlink_to("/dev/pts/12345")
    PtyBoard(SLOW, link=link).stop()
    assert not link.is_symlink()


@pytest.mark.parametrize(
    ("text", "shown"),
    [
        ("plain ü 日本 .toml", "plain ü 日本 .toml"),
        ("\x1b[31m", r"\x1b[31m"),
        ("a\x07\n\x9b\x7f", r"a\x07\n\x9b\x7f"),
        ("\u202e\ud800", r"\u202e\ud800"),
    ],
)
def test_what_a_terminal_would_obey_is_shown(text, shown):
    assert visible(text) == shown


def test_serial_numbers_cannot_command_the_terminal():
    shown = str(Candidate("/dev/ttyUSB0", "ULX3S", "A1\x1b]0;owned\x07"))
    assert shown == r"/dev/ttyUSB0 (ULX3S, serial number A1\x1b]0;owned\x07)"


def test_errors_cannot_command_the_terminal(capsys, monkeypatch):
    def fail(*_, **__):
        raise native.CompileFailed("line 1 \x1b[2J\nline 2")

    monkeypatch.setenv(webassembly.NATIVE, "1")
    monkeypatch.setattr(native, "load", fail)
    assert cli.main(["zones", "--json", "sim://"]) == 1
    assert capsys.readouterr().err == "contactfpga: line 1 \\x1b[2J\nline 2\n"


@pytest.mark.parametrize(
    ("port", "kind", "said"),
    [
        ("", AddressError, "the port has no name"),
        ("xyz://there", AddressError, "there are sim://, replay://FILE, zenoh://KEY and flexitac://DEVICE"),
        ("my touches.mcap", AddressError, "is a file; to play a recording name 'replay://my touches.mcap' as the port"),
        ("robot.toml", AddressError, "is a file; for the boards of a robot there is: contactfpga body robot.toml"),
        ("replay://touches.mcap?speed=2", PortNotFound, "; the options are ?pace=1, ?start=SECONDS and ?link=NAME"),
        ("none", PortNotFound, "is the board plugged in? `contactfpga doctor --list` lists the ports"),
    ],
)
def test_what_is_no_port_is_refused_with_the_next_step(port, kind, said, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for name in ("my touches.mcap", "robot.toml"):
        (tmp_path / name).touch()
    with pytest.raises(kind) as caught:
        contactfpga.open(port)
    assert said in str(caught.value)


@pytest.mark.parametrize(
    ("options", "kind", "said"),
    [
        ({"port": 5}, TypeError, "port is 5; it must be a port's name or a virtual board"),
        ({"record": 5}, TypeError, "record is 5; it must be the name of a file or a Tap"),
        ({"baud": "fast"}, ValueError, "baud is 'fast'; it must be a whole number from 1200 to 200000000"),
    ],
)
def test_what_no_board_can_be_opened_with(options, kind, said):
    with pytest.raises(kind) as caught:
        contactfpga.open(**{"port": "sim://"} | options)
    assert said in str(caught.value)


def test_a_path_is_a_port(tmp_path):
    with pytest.raises(PortNotFound, match="none cannot be opened"):
        contactfpga.open(tmp_path / "none")
