"""The driver on pseudo-terminals: what it reads, and every way a port can go wrong."""

import random
import time

import pytest
from fake_board import ZONE, FakeBoard, background, wait_until
from model_board import DirectPort, ModelBoard
from wire import Wire

import contactfpga
from contactfpga.driver import driver

pytestmark = pytest.mark.usefixtures("_closed_ports")

SKIN = contactfpga.Skin()
LONG = 60.0  # s; what has to come comes at once, but for a machine that is busy


# ---- read_zones


def test_read_zones_gives_the_zone_in_cells_and_mm(board):
    zones = contactfpga.read_zones(board.path, timeout=LONG)
    assert [(z.area_cells, z.sum_x, z.sum_y) for z in zones] == [ZONE]
    assert (zones[0].area_mm2, zones[0].x_mm, zones[0].y_mm) == (400.0, 25.0, 15.0)
    assert zones.pressed == 4
    assert zones.total_zones == 1


@pytest.mark.usefixtures("_asks_once")
def test_port_stays_open_between_reads(board):
    first = contactfpga.read_zones(board.path, timeout=LONG)
    kept = driver._boards[board.path]
    second = contactfpga.read_zones(board.path, timeout=LONG)
    assert driver._boards[board.path] is kept
    assert second.sequence == first.sequence + 1
    assert board.asked == 3  # two to learn what is on the way, then one each


@pytest.mark.parametrize("timeout", [0, -1, float("nan"), float("inf"), "1", None, True])
def test_timeout_must_be_positive_and_finite(timeout):
    with pytest.raises(ValueError, match="must be a positive number of seconds"):
        contactfpga.read_zones("/dev/null", timeout=timeout)


# ---- what can go wrong with the port


def test_silence(board):
    board.answers = False
    start = time.monotonic()
    with pytest.raises(contactfpga.BoardSilent, match="not one byte came") as caught:
        contactfpga.read_zones(board.path, timeout=0.3)
    assert 0.3 <= time.monotonic() - start < LONG
    assert isinstance(caught.value, TimeoutError)
    assert board.path in str(caught.value)
    assert "within 0.3 s" in str(caught.value)
    assert "doctor" in str(caught.value)


class RepeatingPort(DirectPort):
    """A port in simulated time that says the same over and over, and answers nothing."""

    def __init__(self, data):
        super().__init__(SKIN)
        self._data = data

    def write(self, data):
        pass

    def read(self, seconds):
        self._seconds += 0.01
        return self._data


@pytest.mark.parametrize(
    ("data", "error", "said"),
    [
        (random.Random(1).randbytes(997), contactfpga.OnlyNoise, r"bytes came, but no valid packet .*baud rate"),
        (ModelBoard(SKIN).hello(), contactfpga.ReadTimeout, "hellos and 0 frames"),
        (ModelBoard(SKIN).frame(), contactfpga.OnlyNoise, "no valid packet"),
    ],
    ids=["noise", "hellos", "frames without a hello"],
)
def test_what_comes_in_place_of_frames_is_reported(data, error, said):
    with pytest.raises(contactfpga.ReadTimeout, match=said) as caught, contactfpga.open(RepeatingPort(data)) as opened:
        opened.read()
    assert type(caught.value) is error


def test_unplugged_while_waiting(board):
    with contactfpga.open(board.path, timeout=LONG) as opened:
        board.answers = False
        with background(lambda: (time.sleep(0.2), board.unplug())), pytest.raises(contactfpga.PortLost) as caught:
            opened.read(LONG)
    assert board.path in str(caught.value)
    assert "plug the board in" in str(caught.value)


@pytest.mark.usefixtures("_asks_once")
def test_a_board_that_is_unplugged_is_reported_after_its_frames(board):
    with contactfpga.open(board.path, timeout=LONG) as opened:
        opened.next(LONG)
        board.answers = False
        board.send(board.frame())
        wait_until(lambda: opened.stats.frames == board.sent)
        board.unplug()
        assert opened.latest(LONG).sequence == board.sent - 1
        for call in (opened.next, opened.latest, opened.read, opened.batch):
            with pytest.raises(contactfpga.PortLost, match=r"is gone .*; plug the board in and open it again"):
                call(timeout=LONG)


def test_a_port_that_came_back_is_opened_again_and_one_that_stays_away_is_reported(tmp_path):
    link = tmp_path / "port"
    with FakeBoard(SKIN, link):
        contactfpga.read_zones(str(link), timeout=LONG)
    with FakeBoard(SKIN, link) as second:
        second.moments = [(9, 0, 0)]
        assert contactfpga.read_zones(str(link), timeout=LONG)[0].area_cells == 9
    link.unlink()
    for _ in range(2):
        with pytest.raises(contactfpga.PortNotFound, match="is the board plugged in"):
            contactfpga.read_zones(str(link), timeout=0.3)


def test_missing_port_names_the_next_step():
    with pytest.raises(contactfpga.PortNotFound, match=r"/dev/no_such_port .*is the board plugged in\?"):
        contactfpga.open("/dev/no_such_port")


def test_second_client_is_refused_and_the_first_goes_on(board, python):
    with contactfpga.open(board.path, timeout=LONG) as opened:
        for _ in range(2):  # as a cell of a notebook that is run again
            with pytest.raises(contactfpga.PortBusy, match="is in use: this program opened it already; go on"):
                contactfpga.open(board.path)
        code = f"import contactfpga; contactfpga.read_zones({board.path!r})"
        other = python(code)
        assert "PortBusy" in other.stderr
        assert "another program reads this port; close it first" in other.stderr
        assert opened.read(LONG)[0].area_cells == 4
    with contactfpga.open(board.path, timeout=LONG) as again:
        assert again.read(LONG)[0].area_cells == 4


def test_bytes_that_come_one_by_one(board):
    board.slice = 1
    with contactfpga.open(board.path, timeout=LONG) as opened:
        assert opened.next(LONG)[0].area_cells == 4
        assert not opened.stats.damaged


# ---- versions and Skins


def test_a_board_tells_what_it_is():
    with (
        FakeBoard(SKIN.replace(name="left arm", settle_us=6.0)) as fake,
        contactfpga.open(fake.path, timeout=LONG) as opened,
    ):
        assert opened.sheet == SKIN.sheet
        assert (opened.name, opened.clock_hz, opened.baud) == ("left arm", SKIN.clock_hz, SKIN.baud)
        with pytest.raises(contactfpga.ContactFPGAError, match=r"only `board.sheet` is known .*skin='my.toml'"):
            _ = opened.skin
        assert not hasattr(opened, "skin")


def test_the_reference_skin_is_known_by_its_fingerprint(board):
    with contactfpga.open(board.path, timeout=LONG) as opened:
        assert opened.skin == SKIN


def test_the_expected_skin_is_taken_whole(board):
    with contactfpga.open(board.path, skin=SKIN, timeout=LONG) as opened:
        assert opened.skin is SKIN
        assert opened.fingerprint == SKIN.fingerprint


def test_another_skin_than_the_one_asked_for(board):
    other = SKIN.replace(settle_us=6.0)
    with pytest.raises(contactfpga.SkinMismatch) as caught:
        contactfpga.open(board.path, skin=other, timeout=LONG)
    assert SKIN.fingerprint.hex() in str(caught.value)
    assert other.fingerprint.hex() in str(caught.value)


def test_read_takes_a_board_with_a_new_skin_as_it_is(board):
    contactfpga.read_zones(board.path, timeout=LONG)
    board.wire = Wire(SKIN.replace(pitch_x_mm=20.0))
    board.send(board.hello())
    assert contactfpga.read_zones(board.path, timeout=LONG)[0].x_mm == 50.0
