"""The foreign sheet FlexiTac: its bytes as zones, and what becomes of bytes that are lost or wrong."""

import math
import time

import numpy as np
import pytest
from fake_board import patiently
from scipy import ndimage

import contactfpga
from contactfpga.driver import flexitac
from contactfpga.driver.address import Flexitac, parse
from contactfpga.driver.flexitac import Cells, Framer
from contactfpga.errors import AddressError, PortNotFound
from contactfpga_sim.model.board.flexitac import MARK, FlexitacSheet

PITCH_MM = 3.0
LONG = 60.0  # s; what has to come comes at once, but for a machine that is busy


class Touch:
    """Discs of radius 2 cells at (row, column), from ``since`` on, which move for half a second."""

    def __init__(self, *places, columns_per_s=0.0):
        self.places, self.columns_per_s, self.since = places, columns_per_s, math.inf

    def __call__(self, seconds):
        rows, columns = np.mgrid[:16, :32]
        force = np.zeros((16, 32))
        for row, column in self.places if seconds >= self.since else ():
            now = column + self.columns_per_s * min(seconds - self.since, 0.5)
            force[(rows - row) ** 2 + (columns - now) ** 2 <= 4] = 1.0
        return force


def address_of(sheet):
    return f"flexitac://{sheet.port}?frames=10"


def frames_of(board, sheet, touch, count):
    """A frame before a touch and the frames after it, ``count`` of them touched."""
    frames = [board.next(LONG)]
    touch.since = sheet.seconds
    while sum(len(frame) > 0 for frame in frames) < count:
        frames.append(board.next(LONG))
    return frames


class Serial:
    """The sheet at a serial port in simulated time."""

    def __init__(self, device, baud):
        self._seconds, self._sheet = 7.0, FlexitacSheet(Touch())

    def read(self, timeout_s):
        self._seconds += 0.01
        return self._sheet.frame(0.0)

    def clock(self):
        return self._seconds

    def close(self):
        pass


@pytest.fixture
def simulated(monkeypatch):
    monkeypatch.setattr(flexitac, "SerialTransport", Serial)
    port = flexitac.FlexitacPort("flexitac:///dev/x?frames=10")
    port.threaded = False
    with contactfpga.open(port) as board:
        yield board


def test_two_touches_are_two_zones_where_they_are():
    touch = Touch((4, 6), (10, 25))
    with FlexitacSheet(touch) as sheet, contactfpga.open(address_of(sheet), timeout=LONG) as board:
        assert (board.sheet.rows, board.sheet.columns, board.sheet.pitch_x_mm) == (16, 32, PITCH_MM)
        frames, stats = frames_of(board, sheet, touch, 20), board.stats
    assert len(frames[0]) == 0
    assert [(zone.x_mm, zone.y_mm, zone.area_cells) for zone in frames[-1]] == [
        (6 * PITCH_MM, 4 * PITCH_MM, 13),
        (25 * PITCH_MM, 10 * PITCH_MM, 13),
    ]
    assert (stats.lost, sum(stats.damaged.values()), stats.unexplained) == (0, 0, 0)


def test_zones_are_those_of_another_labeller_on_random_frames():
    """Thresholds of each cell, and scipy's zones, by arithmetic that shares no code."""
    rng = np.random.default_rng(1)
    rest = rng.integers(0, 60, (16, 32))
    cells = Cells((16, 32), frames=5, margin=15)
    for _ in range(4):
        assert cells.take(rest.astype(np.uint8).tobytes()) is None
    assert cells.take(np.full((16, 32), 255, np.uint8).tobytes()) is None  # one odd frame moves no median
    for _ in range(20):
        pressed = rng.random((16, 32)) < 0.3
        found = cells.take((rest + np.where(pressed, 15, 14)).astype(np.uint8).tobytes())
        assert (found == pressed).all()
        assert ndimage.label(found, np.ones((3, 3)))[1] == ndimage.label(pressed, np.ones((3, 3)))[1]


def test_a_request_is_answered_by_a_frame_that_began_later(simulated):
    for _ in range(3):
        asked = simulated.clock()
        simulated.read()
        assert 0.02 < simulated.clock() - asked < 0.05  # a frame that was on its way is no answer


def test_it_says_hello_by_itself_as_boards_do_and_keeps_the_hosts_time(simulated):
    """The port sends hellos unrequested; without them, a reader in the network would know no times after a break and
    would get no more frames."""
    hellos = simulated.stats.hellos
    for _ in range(200):
        assert simulated.clock() - simulated.next().time_us / 1e6 == pytest.approx(7.0, abs=0.01)
    stats = simulated.stats
    assert stats.hellos - hellos == 4, "two per second"
    assert (stats.lost, stats.restarts, stats.unexplained, sum(stats.damaged.values())) == (0, 0, 0, 0)


def test_lost_bytes_lose_frames_and_no_frame_is_shifted():
    """One of 2,000 bytes is lost, so that one of four frames of 514 bytes is damaged: these are lost, and no other is
    shifted."""
    touch = Touch((8, 16))
    with FlexitacSheet(touch, lost=1 / 2000) as sheet, contactfpga.open(address_of(sheet), timeout=LONG) as board:
        frames, stats = frames_of(board, sheet, touch, 60), board.stats
    touched = [frame for frame in frames if len(frame)]
    assert all([(zone.x_mm, zone.y_mm) for zone in frame] == [(48.0, 24.0)] for frame in touched)
    damaged = sum(stats.damaged.values())
    assert 0.08 < damaged / (damaged + stats.frames) < 0.4


def test_a_wrong_byte_is_one_cell_of_one_frame_or_costs_the_frame():
    framer, sheet = Framer(512), FlexitacSheet(Touch(), seed=3)
    whole = [sheet.frame(0.0) for _ in range(200)]
    stream = bytearray(b"".join(whole) + MARK)
    rng = np.random.default_rng(2)
    places = sorted(rng.choice(len(whole) * 514, 60, replace=False).tolist())
    for place in places:
        stream[place] ^= 0xFF
    found = framer.take(bytes(stream))
    kept = {frame for frame in found if frame is not None}
    hit = {place // 514: place % 514 for place in places}
    for number, frame in enumerate(whole):
        if number not in hit and hit.get(number + 1, 2) >= 2:
            assert frame[2:] in kept
    marks = sum(place % 514 < 2 for place in places)
    assert len(kept) >= 200 - 2 * marks - 1


@pytest.mark.parametrize("size", [1, 7, 513, 514, 515, 4096])
def test_frames_do_not_depend_on_how_bytes_are_cut(size):
    sheet = FlexitacSheet(Touch(), lost=1 / 1500, seed=5)
    stream = b"".join(sheet.frame(0.0) for _ in range(30))
    whole = Framer(512).take(stream)
    framer = Framer(512)
    cut = [frame for at in range(0, len(stream), size) for frame in framer.take(stream[at : at + size])]
    assert [one for one in cut if one is not None] == [one for one in whole if one is not None]
    assert 5 < sum(one is not None for one in whole) < 30


def test_noise_costs_bounded_memory_and_time():
    framer, started = Framer(512), time.process_time()
    for seed in range(20):
        framer.take(np.random.default_rng(seed).integers(0, 256, 65_536, dtype=np.uint8).tobytes())
        assert len(framer._rest) < 3 * 514
    framer.take(MARK * 30_000)
    assert time.process_time() - started < 5.0


@pytest.mark.parametrize(
    ("address", "meant"),
    [
        ("flexitac:///dev/ttyUSB0", Flexitac("/dev/ttyUSB0")),
        ("flexitac://COM3?margin=20&pitch=2.5", Flexitac("COM3", margin=20, pitch_mm=2.5)),
        ("flexitac:///dev/x?rows=12&frames=10&columns=32&baud=1000000", Flexitac("/dev/x", 15, 10, 3.0, 12, 32, 10**6)),
    ],
)
def test_an_address_has_one_reading(address, meant):
    assert parse(address) == meant


@pytest.mark.parametrize(
    ("address", "message"),
    [
        ("flexitac://", "it names no device"),
        ("flexitac:///dev/x?marge=3", "'marge=3' is no option"),
        ("flexitac:///dev/x?margin=0", "margin is '0'; it must be a whole number from 1 to 255"),
        ("flexitac:///dev/x?margin=1.5", "margin is '1.5'; it must be a whole number"),
        ("flexitac:///dev/x?pitch=nan", "pitch is 'nan'; it must be a number from 0.1 to 100"),
        ("flexitac:///dev/x?rows=999", "rows is '999'; it must be a whole number from 1 to 64"),
    ],
)
def test_what_is_no_address_is_reported(address, message):
    with pytest.raises(AddressError) as caught:
        parse(address)
    assert message in str(caught.value)


@pytest.mark.parametrize(
    ("sheet", "options", "error", "said"),
    [
        ({}, "?rows=12", contactfpga.OnlyNoise, "AA 55 comes every 514 bytes: 16 rows of 32? If so, add rows=16"),
        ({}, "?columns=30", contactfpga.OnlyNoise, "AA 55 comes every 514 bytes, no rows of 30; add rows=N and col"),
        (
            {"wrong": 1.0},
            "",
            contactfpga.OnlyNoise,
            "no AA 55 comes again and again; is 2000000 the sheet's baud rate?",
        ),
        ({"hz": 1e-3}, "", contactfpga.BoardSilent, "not one byte came; is the sheet powered"),
        ({}, "?frames=1000", contactfpga.ReadTimeout, "the first frames tell how cells read at rest; give it a longer"),
    ],
)
def test_a_sheet_without_a_frame_is_reported_by_what_it_sent(sheet, options, error, said):
    def raised(timeout_s):
        with pytest.raises(contactfpga.ReadTimeout) as caught:
            contactfpga.open(f"flexitac://{sent.port}{options}", timeout=timeout_s)
        return caught.value

    with FlexitacSheet(Touch(), **sheet) as sent:
        found = patiently(raised, lambda found: said in str(found), (0.2, 2.0, 9.0, 60.0))
    assert said in str(found)
    assert type(found) is error
    assert "hello" not in str(found)


def test_a_port_that_is_not_there_is_reported():
    with pytest.raises(PortNotFound, match="/dev/nowhere"):
        contactfpga.open("flexitac:///dev/nowhere")
