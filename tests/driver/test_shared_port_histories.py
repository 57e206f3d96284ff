"""Random histories of several sheets at one port: each sheet gets what the line carried for it, and nothing else.

The oracle reads the line's bytes by docs/protocol.md, with another library and the golden model's check.
"""

import random

import pytest
from cobs import cobs
from model_board import DirectPort
from wire import check

from contactfpga import PortNotFound, Skin
from contactfpga.driver import sheets
from contactfpga.driver.address import SheetOf

SKINS = (Skin(name="chest"), Skin(name="back", rows=9, columns=7), Skin(name="arm", columns=3, report="cells"))
PREFIXES = [DirectPort(skin).wire.prefix for skin in SKINS]
HELLO, NUMBERED = 4, 11
FINGERPRINT, PLACE = 5, 10


def numbered(packet, number):
    """A packet with its delimiter as that of a numbered sheet."""
    stuffed = packet[:-4] + bytes([2, 16 * NUMBERED + number])
    return stuffed + check(stuffed, before(packet[-5] >> 4, number)) + b"\0"


def before(kind, number):
    return b"" if kind == HELLO else PREFIXES[number]


def number_in(packet):
    """Whose a packet says it is; None: nobody's."""
    if len(packet) >= 7 and packet[-5] == 2 and packet[-4] >> 4 == NUMBERED:
        return packet[-4] & 15
    return None


def plain_in(packet, prefix):
    """The plain bytes of a packet without delimiters; None: it is damaged."""
    if len(packet) < 5 or check(packet[:-3], b"" if packet[-4] >> 4 == HELLO else prefix) != packet[-3:]:
        return None
    try:
        return cobs.decode(packet[:-3])
    except cobs.DecodeError:
        return None


def wanted(packet, number):
    """The same of a numbered packet."""
    stuffed = packet[:-3]
    if number >= len(SKINS) or check(stuffed, before(packet[-6] >> 4, number)) != packet[-3:]:
        return None
    try:
        return cobs.decode(stuffed)[:-2]
    except cobs.DecodeError:
        return None


class Line:
    """What several sheets send, whole and damaged; ``read`` gives it in pieces, each of which ``heard`` sees first."""

    name, live, threaded = "fake", True, False

    def __init__(self, rng):
        self.rng, self.heard, self.out, self.reads, self.closed = rng, lambda data: None, b"", 0, 0
        self.boards = [DirectPort(skin) for skin in SKINS]

    def say(self):
        rng = self.rng
        number = rng.randrange(len(SKINS))
        packet = self.packet(number)
        match rng.choices(("whole", "flipped", "cut", "joined", "noise", "restart"), (60, 8, 8, 8, 4, 4))[0]:
            case "whole":
                self.out += packet
            case "flipped":
                at = rng.randrange(len(packet))
                self.out += packet[:at] + bytes([packet[at] ^ 1 << rng.randrange(8)]) + packet[at + 1 :]
            case "cut":
                self.out += packet[rng.randrange(len(packet)) :]
            case "joined":
                self.out += packet[:-1] + self.packet(rng.randrange(len(SKINS)))
            case "noise":
                self.out += rng.randbytes(rng.randrange(40))
            case "restart":  # of all, in the middle of a packet
                self.out += packet[: rng.randrange(len(packet))]
                for board in self.boards:
                    board.power_up()

    def packet(self, number):
        board, rng = self.boards[number], self.rng
        board.moments = [(4, rng.randrange(40), rng.randrange(30)) for _ in range(rng.randrange(3))]
        if rng.random() < 0.8:
            return numbered(board.frame(), number)
        if rng.random() < 0.1:
            return board.hello()  # of a bitstream with one sheet
        places = rng.choices(((number, 3), (number, 2), (0, 1), (9, 3)), (12, 2, 1, 2))[0]
        if rng.random() < 0.1:
            return numbered(board.hello(facts=board.wire.facts() | {FINGERPRINT: b"short"}).lstrip(b"\0"), number)
        return b"\0" + numbered(board.hello(facts=board.wire.facts() | {PLACE: bytes(places)}).lstrip(b"\0"), number)

    def read(self, seconds):
        self.reads += 1
        size = self.rng.randrange(1, 300)
        data, self.out = self.out[:size], self.out[size:]
        self.heard(data)
        return data

    def clock(self):
        return float(self.reads)

    def close(self):
        self.closed += 1


class Oracle:
    """What each open sheet has to get, and whether it has to be refused."""

    def __init__(self):
        self.rest, self.sessions, self.sheets, self.alone = b"", {}, None, False

    def take(self, data):
        *packets, self.rest = (self.rest + data).split(b"\0")
        for packet in filter(None, packets):
            number = number_in(packet)
            plain = None if number is None else wanted(packet, number)
            self.note(number, plain, plain_in(packet, b"") if number is None else None)
            for of, items in self.sessions.items():
                if number in (None, of):
                    items.append(plain)

    def note(self, number, plain, unnumbered):
        if unnumbered is not None and unnumbered[-1] >> 4 == HELLO:
            self.alone = True
        if plain is None or plain[-1] >> 4 != HELLO:
            return
        self.alone = False
        found, data = {}, plain[:-1]
        while data:
            found[data[0]], data = data[2 : 2 + data[1]], data[2 + data[1] :]
        if len(found[FINGERPRINT]) >= 8 and found[PLACE][0] < found[PLACE][1]:
            self.sheets = found[PLACE][1]

    def refuses(self, number):
        return self.alone or (self.sheets is not None and number >= self.sheets)


def items_in(data, number):
    return [plain_in(packet, PREFIXES[number]) for packet in data.split(b"\0") if packet]


@pytest.mark.parametrize("seed", range(6))
def test_each_sheet_gets_its_packets_and_no_others(seed):
    rng = random.Random(seed)
    line, oracle = Line(rng), Oracle()
    line.heard = oracle.take
    ports, got, compared, refused = {}, {}, 0, 0

    def close(number):
        ports.pop(number).close()
        items = got.pop(number)
        assert items == oracle.sessions.pop(number)[: len(items)], "what it did not read came later"
        if not ports:
            oracle.__init__()
        return len(items)

    for _ in range(1500):
        number = rng.randrange(len(SKINS))
        if rng.random() < 0.5:
            line.say()
        if number not in ports:
            if rng.random() < 0.1:
                ports[number] = sheets.share(SheetOf("fake", number), 3_000_000, lambda port, baud: line)
                got[number], oracle.sessions[number], oracle.alone = [], [], False
        elif rng.random() < 0.02:
            compared += close(number)
        else:
            try:
                got[number] += items_in(ports[number].read(0.0), number)
                refuses = False
            except PortNotFound:
                refuses = True
            assert got[number] == oracle.sessions[number]
            if refuses:
                assert oracle.refuses(number)
                refused += 1
                close(number)
    for number in list(ports):
        compared += close(number)
    assert sheets._open == {}
    assert line.closed > 2
    assert compared > 100
    assert refused > 3
