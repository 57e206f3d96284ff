"""The driver and the gateware itself: simulated behind sim://, and in real time behind a pseudo-terminal."""

import collections
import contextlib
import itertools
import time

import numpy as np
import pytest
from fake_board import background, wait_until

import contactfpga
from contactfpga_sim.model.board.virtual import VirtualBoard

pytestmark = pytest.mark.usefixtures("_closed_ports")

SKIN = contactfpga.Skin()
LONG = 60.0  # s; what has to come comes at once, but for a machine that is busy


def forever(call):
    while True:
        call()


@pytest.fixture
def pty_board():
    from contactfpga_sim.model.board.pty_board import PtyBoard

    with PtyBoard(SKIN, "two_fingers") as board:
        yield board
    assert board.failure is None


# ---- sim://


def test_simulated_board_answers_read_zones():
    zones = contactfpga.read_zones("sim://?scene=two_fingers")
    assert zones.flags == set()
    assert len(zones) == 2
    assert sum(zone.area_cells for zone in zones) == zones.pressed


@pytest.mark.parametrize("pace", [1.0, 0.2])
def test_a_paced_board_goes_on_while_nobody_reads_and_is_never_ahead(pace):
    began_s = time.monotonic()
    with contactfpga.open(f"sim://?scene=moving&pace={pace}") as opened:
        before = opened.latest(LONG)
        wait_until(lambda: opened.clock() > before.time_us / 1e6 + 0.03)
        after = opened.latest(LONG)
        assert after.time_us - before.time_us > 20_000
        assert opened.read(LONG).time_us > after.time_us
        assert opened.stats.lost == 0
        assert opened.clock() <= pace * (time.monotonic() - began_s)


@pytest.mark.slow
def test_simulated_board_loses_nothing():
    """No frame is lost by the frames and by the gateware's own counter: at each hello, as many were sent as were
    received."""
    with contactfpga.open("sim://?scene=moving") as opened:
        frames = list(itertools.islice(opened, 7_000))
        stats = opened.stats
        assert opened.hello.sent > 5_000
        assert frames[-1].time_us == pytest.approx(opened.clock() * 1e6, abs=1000)
    assert stats.restarts == stats.unexplained == 0
    steps = {after.time_us - before.time_us for before, after in itertools.pairwise(frames)}
    assert stats.lost == 0
    assert not stats.damaged
    assert stats.hellos >= 2  # the one asked for and one of their own in over half a second
    assert steps == {96, 288}  # a hello takes the place of two frames now and then
    assert len({zones[0].x_mm for zones in frames}) > 20


def test_simulated_board_with_an_unknown_option():
    with pytest.raises(contactfpga.AddressError, match=r"scene=NAME"):
        contactfpga.open("sim://?color=red")
    with pytest.raises(contactfpga.AddressError, match="scene 'elbow' is not known"):
        contactfpga.open("sim://?scene=elbow")


# ---- a virtual board of one's own


def test_a_virtual_board_is_pressed_by_a_function_of_time():
    def press(seconds):
        cells = np.zeros((16, 16), bool)
        cells[2, 3 if seconds < 0.01 else 9] = True
        return cells

    with contactfpga.open(VirtualBoard(scene=press)) as opened:
        assert opened.port == "the virtual board"
        assert opened.read()[0].x_mm == 30.0
        while opened.clock() < 0.01:
            opened.next()
        assert opened.read()[0].x_mm == 90.0


@pytest.mark.parametrize("call", ["next", "read", "latest", "batch"])
def test_what_a_function_raises_comes_out_of_the_call_that_waits(call):
    def press(seconds):
        if seconds > 0.005:
            raise RuntimeError("the finger slipped")
        return np.zeros((16, 16), bool)

    with contactfpga.open(VirtualBoard(scene=press)) as opened:
        for _ in range(2):
            with pytest.raises(RuntimeError, match="the finger slipped"):
                forever(getattr(opened, call))


def test_who_polls_a_simulated_board_lets_its_time_pass():
    with contactfpga.open("sim://?scene=moving") as opened:
        opened.next()
        found = []
        for _ in range(5000):
            with contextlib.suppress(contactfpga.ReadTimeout):
                found.append(opened.next(0))
        assert 0 < len(found) < 1000


def test_a_skin_beside_the_address_of_a_virtual_board_says_where_to_put_it():
    with pytest.raises(
        contactfpga.SkinMismatch, match=r"built from the Skin that its address names: sim://\?skin=FILE$"
    ):
        contactfpga.open("sim://", contactfpga.Skin(rows=8))


@pytest.mark.timeout(60)
@pytest.mark.parametrize("call", ["next", "read", "latest", "batch"])
def test_a_function_that_reads_its_own_board_is_told_so(call):
    """A function that drives a simulated board cannot read it: it would wait for time that passes once it has
    returned."""

    def press(seconds):
        if len(opened) and seconds > 0.01:
            getattr(opened[0], call)()
        return np.zeros((16, 16), bool)

    opened = []
    with contactfpga.open(VirtualBoard(scene=press)) as board:
        opened.append(board)
        with pytest.raises(contactfpga.ContactFPGAError, match="its own scene would wait for it for ever"):
            collections.deque(board, maxlen=0)
        opened.clear()
        board.read()


def test_a_function_that_gives_another_sheets_cells_says_so():
    with pytest.raises(ValueError, match=r"cells of shape \(3, 3\); the sheet has 16x16"):
        contactfpga.open(VirtualBoard(scene=lambda seconds: np.zeros((3, 3), bool)))


@pytest.mark.parametrize("record", [False, True])
def test_a_second_client_of_a_virtual_board_is_refused_and_the_first_goes_on(tmp_path, record):
    virtual = VirtualBoard(scene="two_fingers")
    with contactfpga.open(virtual, record=tmp_path / "first.raw" if record else None) as opened:
        with pytest.raises(contactfpga.PortBusy, match="is in use: this program opened it already; close that"):
            contactfpga.open(virtual)
        assert len(opened.read()) == 2
    with pytest.raises(contactfpga.BoardClosed, match="make another one"):
        contactfpga.open(virtual)
    with pytest.raises(contactfpga.BoardClosed):  # and not that it is in use, though that was in vain
        contactfpga.open(virtual)


@pytest.mark.parametrize("call", ["next", "read", "latest", "batch", "clock", "subscribe"])
def test_a_closed_simulated_board_says_so_every_time(call):
    virtual = VirtualBoard()
    opened = contactfpga.open(virtual)
    opened.close()
    for _ in range(2):
        with pytest.raises(contactfpga.BoardClosed):
            getattr(opened, call)()
        with pytest.raises(contactfpga.BoardClosed, match="make another one"):
            virtual.read(0.001)
        with pytest.raises(contactfpga.BoardClosed, match="make another one"):
            virtual.clock()


# ---- a pseudo-terminal


def test_a_board_that_is_stopped_while_it_is_read_is_lost(pty_board):
    with contactfpga.open(pty_board.port, timeout=LONG) as opened:
        frames = opened.stats.frames

        def stop():
            wait_until(lambda: opened.stats.frames > frames + 20)
            pty_board.stop()

        with background(stop), pytest.raises(contactfpga.PortLost) as caught:
            collections.deque(opened, maxlen=0)
    assert pty_board.port in str(caught.value)
    with pytest.raises(contactfpga.PortNotFound):
        contactfpga.read_zones(pty_board.port, timeout=LONG)


def test_a_client_that_left_does_not_end_the_board(pty_board):
    for _ in range(3):
        with contactfpga.open(pty_board.port, timeout=LONG) as opened:
            assert opened.next(LONG).pressed == opened.next(LONG).pressed


def test_a_scene_that_raises_ends_the_port_and_is_reported():
    from contactfpga_sim.model.board.pty_board import PtyBoard

    def press(seconds):
        if seconds > 0.3:
            raise RuntimeError("the finger slipped")
        return np.zeros((16, 16), bool)

    with PtyBoard(SKIN, press) as board, contactfpga.open(board.port, timeout=LONG) as opened:
        with pytest.raises(contactfpga.PortLost):
            forever(lambda: opened.next(LONG))
        assert str(board.failure) == "the finger slipped"
