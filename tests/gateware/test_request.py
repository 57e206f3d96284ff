"""Requests and commands that the board accepts among the bytes it receives."""

from functools import partial

import pytest
from cobs import cobs
from listener import IDLE, Listener, give_bits
from wire import check, crc16, line

from contactfpga_hdl.link.request import RequestReader
from contactfpga_hdl.link.uart import Receiver
from contactfpga_sim.model.golden.request import heard

BIT = 3


@pytest.fixture(scope="module")
def obey(bench):
    """:func:`obeyed` by a board that serves one sheet."""
    dut = RequestReader(commands=True)
    return partial(obeyed, dut, bench(dut))


def obeyed(dut, sim, data, broken=None):
    """(number, hello, command) of all that a board takes that obeys, in bytes whose bits come one per clock; command:
    (what, value) or None; ``broken``: the place of the one byte that has no stop bit."""
    events = []  # level, bit, index, good, bad
    for at, byte in enumerate(data):
        stop = (0, 0, 0, 0, 1) if at == broken else (1, 0, 0, 1, 0)
        events += [*((byte >> index & 1, 1, index, 0, 0) for index in range(8)), stop]
    cycles = give_bits(sim, dut.bits, events)
    seen = {name: sim.watch(getattr(dut, name)) for name in OUTPUTS}
    sim.run(cycles)
    return [one[1:] for one in taken(seen)]


OUTPUTS = ("received", "hello", "number", "heard", "command", "what", "value")


def taken(seen):
    """(cycle, number, hello, command) of what was taken."""
    found = []
    for cycle, received in enumerate(seen["received"].values):
        assert received or not seen["command"][cycle]
        if received:
            assert seen["heard"][cycle + 1] == seen["number"][cycle + 1] % 8
            command = (seen["what"][cycle], seen["value"][cycle]) if seen["command"][cycle] else None
            found.append((cycle, seen["number"][cycle + 1], bool(seen["hello"][cycle]), command))
    return found


def plain(number, hello=False, kind=5):
    return bytes(0x80 | number >> 7 * place & 0x7F for place in range(3)) + bytes([kind << 4 | hello])


def order(number, what, value=0, hello=False, kind=10):
    """A command's plain bytes."""
    fields = ((number, 3), (what, 1), (value, 3))
    return bytes(0x80 | one >> 7 * place & 0x7F for one, count in fields for place in range(count)) + bytes(
        [kind << 4 | hello]
    )


def sealed(plain):
    stuffed = cobs.encode(plain)
    return stuffed + check(stuffed) + b"\0"


@pytest.mark.parametrize("size", range(3, 9))
@pytest.mark.parametrize("code", [1, 9])  # of a request, of a command
def test_a_shorter_packet_with_a_check_that_leaves_nothing_is_not_taken(obey, code, size):
    """A packet that is too short but leaves the CRC register at zero is ignored after a request, whose kind is still
    stored as fitting."""
    shorter = bytes(range(code, code + size - 2))
    low, middle, high = check(shorter)
    shorter += (low & 0x7F | (middle & 0x7F) << 7 | (high & 3) << 14).to_bytes(2, "little")
    assert 0 not in shorter
    assert obey(b"\0" + sealed(plain(9)) + shorter + b"\0") == [(9, False, None)]


# ---- commands


@pytest.mark.parametrize("packet", [plain(9), order(9, 1, 5)])
def test_a_packet_one_of_whose_bytes_has_no_stop_bit_is_not_taken(obey, packet):
    """Though all its bits are right."""
    data = b"\0" + sealed(packet) + b"\0" + sealed(plain(10))
    for broken in range(1, len(sealed(packet)) + 1):
        assert obey(data, broken) == [(10, False, None)]
    assert len(obey(data)) == 2


def test_a_board_without_commands_ignores_them(bench):
    dut = Listener(Receiver(BIT))
    assert not hasattr(dut.reader, "command")
    sim = bench(dut)
    data = b"\0" + sealed(order(9, 1)) + sealed(plain(10))
    cycles = dut.receive(sim, line(data, BIT))
    received, number = sim.watch(dut.reader.received), sim.watch(dut.reader.number)
    sim.run(cycles)
    assert [number[cycle + 1] for cycle, taken in enumerate(received.values) if taken] == [10]


NEITHER = [
    *(sealed(body) for body in (b"", plain(9)[1:], b"\x81" + plain(9), plain(9) + b"\x51")),
    *(sealed(body) for body in (order(9, 1)[1:], b"\x81" + order(9, 1), order(9, 1) + b"\xa1")),
    *(sealed(body)[:-2] + b"\0" for body in (plain(9), order(9, 1))),
    sealed(plain(9))[:-1] + b"\x80\0",
    b"?\0",
    b"\0",
]
"""Packets of other lengths."""


def test_what_is_neither_request_nor_command_is_passed_over_and_the_next_one_taken(obey):
    after = b"\0" + sealed(order(10, 1)) + sealed(plain(11))
    found = obey(b"\0" + b"".join(other + after for other in NEITHER))
    assert found == [(10, False, (1, 0)), (11, False, None)] * len(NEITHER)


def test_no_flip_of_a_bit_makes_another_command(obey):
    """Each bit of a command is flipped. Five bits of the last check byte and one of each other byte mean nothing: these
    commands are taken."""
    whole = sealed(order(0x12345 | 1, 1, 0x54321, True))
    bits = 8 * (len(whole) - 1)
    word = int.from_bytes(whole, "little")
    data = b"".join(b"\0" + (word ^ 1 << bit).to_bytes(len(whole), "little") for bit in range(bits))
    found = obey(data + b"\0")
    assert set(found) == {(0x12345 | 1, True, (1, 0x54321))}
    assert len(found) == 1 + 1 + 6


def test_each_bit_that_a_wrong_check_leaves_counts(obey):
    """Checks that leave one bit of 16, found by running the CRC backward."""
    stuffed, data = cobs.encode(plain(9)), b"\0"
    for bit in range(16):
        wrong = 1 << bit
        for _ in range(16):
            wrong = (wrong << 1 ^ 0x10811 * (wrong >> 15)) & 0xFFFF
        pieces = crc16(stuffed) ^ wrong
        data += stuffed + bytes(0x80 | pieces >> shift & 0x7F for shift in (0, 7, 14)) + b"\0"
    assert obey(data + sealed(plain(10))) == [(10, False, None)]


def test_no_other_kind_is_taken(obey):
    kinds = [sealed(plain(9, kind=kind)) + sealed(order(10, 1, 5, kind=kind)) for kind in range(16)]
    assert obey(b"\0" + b"".join(kinds)) == [(9, False, None), (10, False, (1, 5))]


@pytest.mark.whole
@pytest.mark.parametrize("sheet", [5, 10])
def test_a_sheet_of_several_takes_what_has_its_number_in_every_bit(bench, sheet):
    """Packets are ignored if one bit of the two bytes that tell the sheet is wrong, with a check that is right."""
    dut = RequestReader(commands=True, sheet=sheet)
    packets = []
    for wrong in [1 << bit for bit in range(16)] + [0]:
        for whole in (plain(9, True), order(10, 127, 77)):
            numbered = cobs.encode(whole) + (0xB002 + (sheet << 8) ^ wrong).to_bytes(2, "little")
            packets.append(numbered + check(numbered) + b"\0")
    assert obeyed(dut, bench(dut), b"\0" + b"".join(packets)) == [(9, True, None), (10, False, (127, 77))]


def test_any_bytes_hold_what_the_model_finds(bench, rng):
    """In random bytes, requests, commands and parts of some, the reader finds those of the golden model, in the same
    clock, with the same number."""
    bit_clocks = 4
    dut = Listener(Receiver(bit_clocks), commands=True)
    data = b"\0"
    for _ in range(40):
        asks = rng.random() < 0.5
        number = rng.randrange(1 << 21)
        command = order(number, rng.randrange(128), rng.randrange(1 << 21), asks, rng.choice([10, 10, 5]))
        part = rng.choice([sealed(plain(number, asks)), sealed(command), sealed(command), b"\0", rng.randbytes(3)])
        data += part[: rng.randrange(len(part) + 1)] if rng.random() < 0.2 else part
    sim = bench(dut)
    cycles = dut.receive(sim, line(data, bit_clocks))
    seen = {name: sim.watch(getattr(dut.reader, name)) for name in OUTPUTS}
    sim.run(cycles)
    expected = heard([(IDLE, data)], bit_clocks, commands=True)
    assert taken(seen) == [(one.cycle, one.number, one.hello, one.command) for one in expected.requests]
    assert seen["number"].values == [expected.number(cycle) for cycle in range(cycles)]
    assert sum(one.command is not None for one in expected.requests) > 4
    assert sum(one.command is None for one in expected.requests) > 2
