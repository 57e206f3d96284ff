"""The board is found among the ports by its USB ids and its hello."""

import contextlib
import dataclasses
import json
import os
import select
from types import SimpleNamespace

import pytest
from fake_board import FakeBoard

import contactfpga
from contactfpga.boards import BOARDS
from contactfpga.driver import finding
from contactfpga.tools import cli

pytestmark = pytest.mark.usefixtures("_closed_ports")

SKIN = contactfpga.Skin()
LONG = 60.0  # s; what has to come comes at once, but for a machine that is busy


def usb(device, vid=0x0403, pid=0x6010, interface=1):
    return SimpleNamespace(device=device, vid=vid, pid=pid, interface_num=interface, serial_number="A1")


def test_only_serial_interfaces_of_supported_boards_are_candidates():
    listed = [
        usb("/dev/ttyUSB3"),
        usb("/dev/ttyUSB2", interface=0),
        usb("/dev/ttyUSB1", pid=0x6015, interface=0),
        usb("/dev/ttyUSB0", pid=0x6001),
        usb("COM7", interface=None),
        SimpleNamespace(device="/dev/ttyS0"),
    ]
    assert [candidate.device for candidate in finding.choose(listed)] == ["/dev/ttyUSB1", "/dev/ttyUSB3", "COM7"]


def test_boards_of_one_chip_are_one_candidate_wherever_they_stand_in_the_table():
    mine = dataclasses.replace(BOARDS["icebreaker"], name="mine", title="Mine")
    supported = finding.supported([*BOARDS.values(), mine])
    boards = ["iCEBreaker, iCEStick, Mine", "ULX3S 12F, ULX3S 85F", "ULX3S 12F with FT232H"]
    assert [usb.boards for usb in supported] == boards
    assert finding.supported(BOARDS.values()) == finding.SUPPORTED


def plug_in(monkeypatch, *boards):
    """Boards, or devices that are none."""
    found = []
    for index, board in enumerate(boards):
        if isinstance(board, FakeBoard):
            board.hello_s = 0.05
        path = board.path if isinstance(board, FakeBoard) else board
        found.append(finding.Candidate(path, "ULX3S", f"A{index + 1}"))
    monkeypatch.setattr(finding, "candidates", lambda: found)
    monkeypatch.setattr(finding, "LISTEN_S", LONG)  # who hears a hello listens no longer


def test_no_board_plugged_in(monkeypatch):
    plug_in(monkeypatch)
    with pytest.raises(contactfpga.PortNotFound, match=r"0403:6015 \(ULX3S 12F, ULX3S 85F\).*sim://"):
        contactfpga.read_zones()


def test_the_one_board_that_answers_is_taken(monkeypatch, board):
    with FakeBoard(SKIN) as silent:
        plug_in(monkeypatch, silent, board)
        silent.hello_s, listen = 0.0, finding.listen
        monkeypatch.setattr(
            finding, "listen", lambda port, baud: listen(port, baud, 0.1 if port == silent.path else LONG)
        )
        with contactfpga.open(timeout=LONG) as opened:
            assert opened.port == board.path
        assert contactfpga.read_zones(timeout=LONG)[0].area_cells == 4
        assert silent.asked == 0


def test_several_boards_are_listed(monkeypatch, board):
    with FakeBoard(SKIN) as second:
        plug_in(monkeypatch, second, board)
        with pytest.raises(contactfpga.PortNotFound, match=r"several boards answer.*usb:A1 or usb:A2") as caught:
            contactfpga.open()
    assert f"{second.path} (ULX3S, serial number A1): says hello" in str(caught.value)
    assert f"{board.path} (ULX3S, serial number A2): says hello" in str(caught.value)


def test_candidates_that_do_not_answer_are_listed(monkeypatch, board):
    plug_in(monkeypatch, board)
    monkeypatch.setattr(finding, "LISTEN_S", 0.3)
    board.hello_s = 0.0
    with pytest.raises(contactfpga.PortNotFound, match=r"no board answers.*not one byte came"):
        contactfpga.open()


# ---- boards found by what they are


@pytest.fixture
def three(monkeypatch):
    """Two boards that differ in their name alone, and one of another Skin."""
    skins = SKIN.replace(name="LEFT"), SKIN.replace(name="RIGHT"), SKIN.replace(rows=8)
    with contextlib.ExitStack() as stack:
        boards = [stack.enter_context(FakeBoard(skin)) for skin in skins]
        plug_in(monkeypatch, *boards)
        yield boards


def test_a_skin_finds_its_board(three, tmp_path):
    with contactfpga.open(skin=SKIN.replace(rows=8), timeout=LONG) as opened:
        assert opened.port == three[2].path
    file = tmp_path / "bumper.toml"
    file.write_text("rows = 8\n")
    with contactfpga.open(skin=file, timeout=LONG) as opened:
        assert opened.port == three[2].path


def test_a_name_tells_identical_boards_apart(three):
    for name, board in zip(("LEFT", "RIGHT"), three, strict=False):
        for skin in (None, SKIN):
            with contactfpga.open(f"name:{name}", skin, timeout=LONG) as opened:
                assert (opened.port, opened.name) == (board.path, name)
    with pytest.raises(contactfpga.PortNotFound, match=r"several boards answer with fingerprint .*: name:LEFT or name"):
        contactfpga.open(skin=SKIN)


def test_the_name_in_a_skin_tells_identical_boards_apart(three):
    """A Skin's name selects one of several boards; a board without that name is taken if it is the only one of its
    Skin."""
    with contactfpga.open(skin=SKIN.replace(name="RIGHT"), timeout=LONG) as opened:
        assert opened.port == three[1].path
    with pytest.raises(contactfpga.PortNotFound, match=r"several boards answer with fingerprint .*: name:LEFT or name"):
        contactfpga.open(skin=SKIN.replace(name="HEAD"))
    with contactfpga.open(skin=SKIN.replace(rows=8, name="HEAD"), timeout=LONG) as opened:
        assert opened.port == three[2].path


def test_a_serial_number_opens_its_port_without_a_search(three, monkeypatch):
    monkeypatch.setattr(finding, "survey", lambda *_: pytest.fail("it searched"))
    with contactfpga.open("usb:A2", timeout=LONG) as opened:
        assert opened.name == "RIGHT"
    with pytest.raises(contactfpga.PortNotFound, match="USB serial number A9 is plugged in; there is A1, A2, A3"):
        contactfpga.open("usb:A9")


def test_what_is_not_there_is_named_with_what_is(three):
    with pytest.raises(contactfpga.PortNotFound, match=r"no board named 'HEAD' is here.*named 'LEFT'.*named 'RIGHT'"):
        contactfpga.open("name:HEAD")
    with pytest.raises(contactfpga.PortNotFound, match=r"no board with fingerprint .* is here"):
        contactfpga.open(skin=SKIN.replace(rows=9))
    with pytest.raises(contactfpga.PortNotFound, match=r"no board named 'HEAD' with fingerprint .* is here"):
        contactfpga.open("name:HEAD", SKIN.replace(rows=8))
    with pytest.raises(contactfpga.SkinMismatch, match=r"was built from .*rows"):
        contactfpga.open("name:LEFT", SKIN.replace(rows=8), timeout=LONG)


def test_a_search_writes_to_no_port(three):
    """A search writes neither to boards nor to other devices with this USB chip."""
    with pytest.raises(contactfpga.PortNotFound):
        contactfpga.open("name:HEAD")
    assert [board.asked for board in three] == [0, 0, 0]
    assert not any(select.select([board._master], [], [], 0)[0] for board in three)


def test_a_search_does_not_disturb_an_open_board(three):
    three[0].slice = 1 << 16
    with contactfpga.open("name:LEFT", timeout=LONG) as opened:
        with pytest.raises(contactfpga.PortBusy, match="in use: this program opened it already") as caught:
            contactfpga.open("name:LEFT")
        assert not isinstance(caught.value, contactfpga.PortNotFound)
        with contactfpga.open("name:RIGHT", timeout=LONG) as other:
            assert other.name == "RIGHT"
        three[0].send(b"".join(three[0].frame() for _ in range(50)))
        assert opened.read(LONG)
        assert (opened.stats.lost, opened.stats.damaged.total()) == (0, 0)


def test_a_port_that_read_zones_keeps_open_goes_to_who_opens_it(board, monkeypatch):
    """`open` takes over a port that `read_zones` keeps open, as in a notebook whose first cell reads zones: users
    cannot close that one themselves."""
    plug_in(monkeypatch, board)
    for port in (board.path, None):
        assert len(contactfpga.read_zones(port, LONG)) == 1
        with contactfpga.open(port, timeout=LONG) as opened:
            assert len(opened.read(LONG)) == 1
            with pytest.raises(contactfpga.PortBusy, match="this program opened it already"):
                contactfpga.read_zones(port, LONG)
            assert len(opened.read(LONG)) == 1
        assert len(contactfpga.read_zones(port, LONG)) == 1


def test_more_ports_are_searched_where_they_are_named(monkeypatch, board):
    monkeypatch.setenv(finding.MORE, os.pathsep.join([board.path, board.path]))
    named = [one for one in finding.candidates() if one.device == board.path]
    assert [str(one) for one in named] == [f"{board.path} (in CONTACTFPGA_PORTS)"]


def test_doctor_lists_the_boards(three, capsys, monkeypatch):
    assert cli.main(["doctor", "--list", "--json"]) == 0
    listed = json.loads(capsys.readouterr().out)
    assert [(one["name"], one["serial_number"], one["rows"]) for one in listed] == [
        ("LEFT", "A1", 16),
        ("RIGHT", "A2", 16),
        ("", "A3", 8),
    ]
    assert cli.main(["doctor", "--list"]) == 0
    assert "named 'LEFT'" in " ".join(capsys.readouterr().out.split())
    three[1].stream = three[1].frame
    assert cli.main(["doctor", "name:RIGHT", "--seconds", "0.01", "--timeout", str(LONG), "--json"]) == 0
    assert "'RIGHT'" in capsys.readouterr().out
    three[1].stream = b""
    monkeypatch.setattr(finding, "LISTEN_S", 0.3)
    for board in three:
        board.hello_s = 0.0
    assert cli.main(["doctor", "--list"]) == 1
    said = " ".join(capsys.readouterr().out.split())
    assert "no board said hello" in said
    assert "are listened to where CONTACTFPGA_PORTS names them" in said
