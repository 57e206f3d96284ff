"""Several sheets at one port: each is a board of its own to whoever opens it."""

import threading

import pytest
from model_board import DirectPort

import contactfpga
from contactfpga import AddressError, ContactFPGAError, PortLost, PortNotFound, Skin
from contactfpga.driver import finding, sheets
from contactfpga.driver.address import SheetOf
from contactfpga.driver.board import Board
from contactfpga.driver.finding import Candidate
from contactfpga.wire.sheet_number import numbered, sheet_of, unnumbered

SKINS = (Skin(name="chest", row_drive="74hc595", column_read="74hc165"), Skin(name="back", rows=9, columns=7))


class Sheet(DirectPort):
    """One of the sheets on a port; its packets have no number yet."""

    def __init__(self, number, skin):
        super().__init__(skin)
        self.place = bytes([number, len(SKINS)])
        self.moments = [(4, 10 + number, 6)]

    def hello(self, **options):
        return super().hello(facts=self.wire.facts() | {10: self.place}, **options)


class Line:
    """A port with both sheets, in simulated time."""

    live, threaded = True, False

    def __init__(self, name="fake"):
        self.name = name
        self.boards = [Sheet(number, skin) for number, skin in enumerate(SKINS)]
        self.out = b""
        self.seconds = 0.0
        self.closed = 0
        self.failure = None
        self.said_unasked = b""

    def write(self, data):
        for packet in filter(None, data.split(b"\0")):
            if (number := sheet_of(packet)) not in (0, 1):
                continue  # pulses, or of no sheet
            self.boards[number].write(b"\0" + unnumbered(packet) + b"\0")
            self.say(number, self.boards[number].read(0.0))

    def say(self, number, data):
        self.out += b"".join(numbered(packet, number) + b"\0" for packet in filter(None, data.split(b"\0")))

    def read(self, seconds):
        if self.failure is not None:
            raise self.failure
        data, self.out = self.out[:50] or self.said_unasked, self.out[50:]
        self.seconds += 0.0 if data and not self.said_unasked else seconds
        return data

    def clock(self):
        return self.seconds

    def close(self):
        self.closed += 1


@pytest.fixture
def line():
    yield (one := Line())
    assert (one.closed, sheets._open) == (1, {})
    sheets._open.clear()


def opened(line, number, baud=3_000_000):
    board = Board(sheets.share(SheetOf("fake", number), baud, lambda port, baud: line))
    try:
        board.greet(1.0)
    except ContactFPGAError:
        board.close()
        raise
    return board


def test_threads_that_wait_for_their_sheets_all_get_their_frames(line):
    """Each thread gets its sheet's frames while another thread opens and closes sheets."""
    boards = [opened(line, number) for number in (0, 1)]
    found, done = [[], []], threading.Event()

    def follow(number):
        found[number] += [boards[number].read(1e3)[0].sum_x for _ in range(30)]

    def visit():
        while not done.is_set():
            sheets.share(SheetOf("fake", 1), 3_000_000).close()

    threads = [threading.Thread(target=follow, args=(number,)) for number in (0, 1)]
    visitor = threading.Thread(target=visit)
    for thread in (*threads, visitor):
        thread.start()
    for thread in threads:
        thread.join()
    done.set()
    visitor.join()
    assert found == [[10] * 30, [11] * 30]
    for board in boards:
        board.close()


def test_noise_without_an_end_is_not_kept():
    """A line at another baud rate may have no delimiter."""
    sorter = sheets.Sorter()
    for _ in range(10):
        assert sorter.take(b"\xaa" * 30_000) == [(None, b"\x01\0")]
        assert not sorter._rest


def test_what_nobody_takes_is_dropped_by_whole_packets_and_counted(line, monkeypatch):
    monkeypatch.setattr(sheets, "MOST_WAIT", 8)
    with opened(line, 0) as chest, opened(line, 1) as back:
        for _ in range(20):
            line.say(1, line.boards[1].frame())
        chest.read()
        line.say(1, line.boards[1].hello())
        chest.read()
        back.read()
        assert back.stats.lost > 10
        assert back.stats.damaged.total() == 0


def test_a_sheet_that_the_board_does_not_have_is_named(line):
    with opened(line, 0), pytest.raises(PortNotFound, match="fake#2: the board at fake has the sheets 0 to 1"):
        opened(line, 2)


def test_a_board_of_one_sheet_has_no_numbers(line):
    line.write = lambda data: None
    line.out = DirectPort(SKINS[0]).hello()
    with pytest.raises(PortNotFound, match="fake#0: the board at fake has one sheet, without a number; open fake"):
        opened(line, 0)


def test_a_board_of_several_sheets_names_their_ports(line, monkeypatch):
    monkeypatch.setattr("contactfpga.driver.driver.connect", lambda port, baud: line)
    for number in (0, 1):
        line.say(number, line.boards[number].hello() + line.boards[number].frame())
    line.write = lambda data: None
    with pytest.raises(
        ContactFPGAError, match="fake: this board serves several sheets; open one of them: fake#0, fake#1"
    ):
        contactfpga.open("fake")


def test_another_baud_rate_at_an_open_port_is_refused(line):
    with opened(line, 0), pytest.raises(ContactFPGAError, match=r"fake#1: another sheet.*open at 3000000 baud"):
        opened(line, 1, baud=1_000_000)


def test_a_lost_port_is_lost_for_all_and_opened_anew_after(line):
    with opened(line, 0) as chest, opened(line, 1) as back:
        line.failure = PortLost("fake is gone")
        for board in (chest, back):
            with pytest.raises(PortLost, match="fake is gone"):
                board.read()
        other = Line()
        with opened(other, 1) as again:
            assert again.read()[0].sum_x == 11
        assert other.closed == 1


def test_numbers_of_sheets_end_a_port():
    assert SheetOf.parse("/dev/ttyUSB0#1") == SheetOf("/dev/ttyUSB0", 1)
    assert SheetOf.parse("sim://?skin=a#b.toml") is None
    with pytest.raises(AddressError, match="port#16: sheets have the numbers 0 to 15"):
        SheetOf.parse("port#16")
    with pytest.raises(AddressError, match="port#1#0: it names two sheets; give one number, as in port#0"):
        contactfpga.open("port#1#0")


def test_a_search_finds_each_sheet(monkeypatch):
    line = Line()
    line.said_unasked = b"".join(
        numbered(board.hello().strip(b"\0"), number) + b"\0" for number, board in enumerate(line.boards)
    )
    monkeypatch.setattr(finding, "connect", lambda port, baud: line)
    monkeypatch.setattr(finding, "candidates", lambda: [Candidate("fake", "a board", "ABC")])
    heard = finding.survey(finding.candidates(), 3_000_000)
    assert [(one.candidate.device, one.hello.name) for one in heard] == [("fake#0", "chest"), ("fake#1", "back")]
    assert finding.find("name:back", None, 3_000_000) == "fake#1"
    assert finding.find(None, SKINS[0], 3_000_000) == "fake#0"
    assert finding.find("usb:ABC#1", None, 3_000_000) == "fake#1"
    with pytest.raises(PortNotFound, match=r"several boards answer.*name:chest or name:back"):
        finding.find(None, None, 3_000_000)


def test_a_search_listens_to_a_port_whose_sheets_are_open(line, monkeypatch):
    with opened(line, 0):
        for number, board in enumerate(line.boards):
            line.say(number, board.hello())
        monkeypatch.setattr(finding, "connect", lambda name, baud: sheets.share(SheetOf.parse(name), baud))
        line.said_unasked = b"".join(
            numbered(board.hello().strip(b"\0"), number) + b"\0" for number, board in enumerate(line.boards)
        )
        heard = finding.survey([Candidate("fake", "a board")], 3_000_000)
        line.said_unasked = b""
        assert [one.hello.name for one in heard] == ["chest", "back"]
