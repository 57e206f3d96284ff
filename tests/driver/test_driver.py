"""The driver on pseudo-terminals: what it reads, and every way a port can go wrong."""

import random
import re
import time

import pytest
from fake_board import ZONE, FakeBoard, background, patiently, wait_until
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


@pytest.mark.usefixtures("_asks_once")
def test_frames_older_than_the_call_are_passed_over(board):
    contactfpga.read_zones(board.path, timeout=LONG)
    opened = driver._boards[board.path]
    board.moments = [(1, 0, 0)]
    board.send(board.frame() * 1 + board.frame() + board.frame())
    wait_until(lambda: opened.stats.frames == 5)
    board.moments = [(2, 1, 0)]
    assert contactfpga.read_zones(board.path, timeout=LONG)[0].area_cells == 2


def test_the_answer_to_a_question_that_timed_out_is_not_taken_for_the_next(board):
    """A bridge with latency: each answer comes after its question has timed out, while the next one is open."""
    late = []

    def answer():
        wait_until(lambda: board.asked > asked)
        board.send(b"".join(late))
        board.moments, board.answers = [(99, 0, 0)], True

    with contactfpga.open(board.path, timeout=LONG) as opened:
        board.answers = False
        for area in range(1, 6):
            board.moments, asked = [(area, 0, 0)], board.asked
            with pytest.raises(contactfpga.ReadTimeout):
                opened.read(0.02)
            wait_until(lambda: board.asked > asked)  # noqa: B023
            late.append(board.frame())
        asked = board.asked
        with background(answer):
            assert opened.read(LONG)[0].area_cells == 99


def test_an_answer_to_the_program_before_is_not_taken_for_one_to_this(board):
    with contactfpga.open(board.path, timeout=LONG) as opened:
        board.answers = False
        with pytest.raises(contactfpga.ReadTimeout):
            opened.read(0.1)
    board.moments = [(1, 0, 0)]
    for low in range(1, 8):
        board.send(board.hello() + board.frame(heard=low))
    board.answers, board.moments = True, [(99, 0, 0)]
    with contactfpga.open(board.path, timeout=LONG) as again:
        assert again.read(LONG)[0].area_cells == 99


def test_a_request_that_is_lost_is_sent_again(board):
    with contactfpga.open(board.path, timeout=LONG) as opened:
        board.answers = False
        asked, begun = board.asked, time.monotonic()

        def answer_later():
            wait_until(lambda: board.asked > asked)
            board.answers = True

        with background(answer_later):
            opened.read(LONG)
        # Where the machine lets the answer wait, each quarter of a second once more.
        assert 2 <= board.asked - asked <= 2 + (time.monotonic() - begun) / 0.25


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


def failure(board):
    """What reading it raises once bytes came."""

    def read(timeout_s):
        with pytest.raises(contactfpga.ReadTimeout) as caught:
            contactfpga.read_zones(board.path, timeout=timeout_s)
        return caught.value

    return patiently(read, lambda error: not isinstance(error, contactfpga.BoardSilent))


def test_noise(board):
    board.answers = False
    board.stream = bytes(random.Random(1).randbytes(997))
    error = failure(board)
    assert isinstance(error, contactfpga.OnlyNoise)
    assert re.search(r"bytes came, but no valid packet .*baud rate", str(error))


def test_hello_without_frames(board):
    board.answers = False
    board.stream = board.hello()
    error = failure(board)
    assert "hellos and 0 frames" in str(error)
    assert not isinstance(error, contactfpga.BoardSilent | contactfpga.OnlyNoise)


def test_frames_without_a_hello_are_not_read(board):
    board.greets = False
    with pytest.raises(contactfpga.ReadTimeout):
        contactfpga.read_zones(board.path, timeout=1.0)


def test_unplugged_while_waiting(board):
    with contactfpga.open(board.path, timeout=LONG) as opened:
        board.answers = False
        with background(lambda: (time.sleep(0.2), board.unplug())), pytest.raises(contactfpga.PortLost) as caught:
            opened.read(LONG)
    assert board.path in str(caught.value)
    assert "plug the board in" in str(caught.value)


@pytest.mark.usefixtures("_asks_once")
def test_unplugged_while_iterating(board):
    with contactfpga.open(board.path, timeout=LONG) as opened:
        frames = iter(opened)
        next(frames)
        board.unplug()
        with pytest.raises(contactfpga.PortLost):
            next(frames)


def test_port_that_came_back_is_opened_again(tmp_path):
    link = tmp_path / "port"
    with FakeBoard(SKIN, link):
        contactfpga.read_zones(str(link), timeout=LONG)
    with FakeBoard(SKIN, link) as second:
        second.moments = [(9, 0, 0)]
        assert contactfpga.read_zones(str(link), timeout=LONG)[0].area_cells == 9


def test_port_that_stays_away(tmp_path):
    link = tmp_path / "port"
    with FakeBoard(SKIN, link):
        contactfpga.read_zones(str(link), timeout=LONG)
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


def test_another_protocol_version(board):
    board.old = True
    with pytest.raises(contactfpga.VersionMismatch, match="speaks protocol version 1, this host version 2"):
        contactfpga.read_zones(board.path, timeout=LONG)


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


@pytest.mark.usefixtures("_asks_once")
def test_skin_that_changes_mid_stream_is_noticed_after_the_frames_before_it(board):
    with contactfpga.open(board.path, timeout=LONG) as opened:
        opened.next(LONG)
        last = board.frame()
        board.wire = Wire(SKIN.replace(rows=8, columns=40, settle_us=10.0))
        board.moments = [(1, 39, 7)]
        board.power_up()
        board.send(last + board.hello() + board.frame())
        assert opened.next(LONG)[0].area_cells == 4
        with pytest.raises(contactfpga.SkinMismatch, match=r"now has a 8x40 Skin.*before it was a 16x16"):
            opened.next(LONG)
        assert opened.next(LONG)[0].x_mm == 390.0
        assert opened.sheet.columns == 40
        assert opened.stats.skin_changes == 1
        assert opened.stats.lost == 0


def test_read_takes_a_board_with_a_new_skin_as_it_is(board):
    contactfpga.read_zones(board.path, timeout=LONG)
    board.wire = Wire(SKIN.replace(pitch_x_mm=20.0))
    board.send(board.hello())
    assert contactfpga.read_zones(board.path, timeout=LONG)[0].x_mm == 50.0
