"""The board is found among the ports by its USB ids and its hello."""

import dataclasses
from types import SimpleNamespace

import pytest
from fake_board import FakeBoard

import contactfpga
from contactfpga.boards import BOARDS
from contactfpga.driver import driver, ports

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
    assert [candidate.device for candidate in ports.choose(listed)] == ["/dev/ttyUSB1", "/dev/ttyUSB3", "COM7"]


def test_boards_of_one_chip_are_one_candidate_wherever_they_stand_in_the_table():
    mine = dataclasses.replace(BOARDS["icebreaker"], name="mine", title="Mine")
    supported = ports.supported([*BOARDS.values(), mine])
    boards = ["iCEBreaker, iCEStick, Mine", "ULX3S 12F, ULX3S 85F", "ULX3S 12F with FT232H"]
    assert [usb.boards for usb in supported] == boards
    assert ports.supported(BOARDS.values()) == ports.SUPPORTED


def plug_in(monkeypatch, *devices):
    found = [ports.Candidate(device, "ULX3S", "A1") for device in devices]
    monkeypatch.setattr(ports, "candidates", lambda: found)
    monkeypatch.setattr(driver, "PROBE_S", 1.0)


def test_no_board_plugged_in(monkeypatch):
    plug_in(monkeypatch)
    with pytest.raises(contactfpga.PortNotFound, match=r"0403:6015 \(ULX3S 12F, ULX3S 85F\).*sim://"):
        contactfpga.read_zones()


def test_the_one_board_that_answers_is_taken(monkeypatch, board):
    with FakeBoard(SKIN) as silent:
        silent.answers = False
        plug_in(monkeypatch, silent.path, board.path)
        with contactfpga.open(timeout=LONG) as opened:
            assert opened.port == board.path
        assert contactfpga.read_zones(timeout=LONG)[0].area_cells == 4


def test_several_boards_are_listed(monkeypatch, board):
    with FakeBoard(SKIN) as second:
        plug_in(monkeypatch, second.path, board.path)
        with pytest.raises(contactfpga.PortNotFound, match="several boards answer") as caught:
            contactfpga.open()
    for path in (second.path, board.path):
        assert f"{path} (ULX3S, serial number A1): says hello" in str(caught.value)


def test_candidates_that_do_not_answer_are_listed(monkeypatch, board):
    board.answers = False
    plug_in(monkeypatch, board.path)
    with pytest.raises(contactfpga.PortNotFound, match=r"no board answers.*not one byte came"):
        contactfpga.open()
