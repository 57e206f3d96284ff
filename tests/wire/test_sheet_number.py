"""Packets of a numbered sheet: what they are, and that without the number they are ordinary ones."""

import random

import pytest
from cobs import cobs
from wire import check

from contactfpga import Skin
from contactfpga.driver.conversation import Conversation
from contactfpga.wire import framing, protocol, sheet_number
from contactfpga.wire.framing import PacketError
from contactfpga_sim.model.golden.facts import Facts
from contactfpga_sim.model.golden.hello import hello
from contactfpga_sim.model.golden.request import request

SKIN = Skin(row_drive="74hc595", column_read="74hc165")


def packets(seed, count=60):
    """(plain bytes that end with a frame's last byte, what the check covers in front)."""
    rng = random.Random(seed)
    for length in (0, 1, 3, 252, 253, 254, 255, *(rng.randrange(40) for _ in range(count))):
        zeros = rng.random()
        plain = bytes(0 if rng.random() < zeros else rng.randrange(256) for _ in range(length))
        yield plain + b"\x51", rng.randbytes(2)


def test_a_numbered_packet_is_an_ordinary_one_with_two_bytes_that_the_check_covers():
    for number, (plain, before) in enumerate(packets(1)):
        stuffed = cobs.encode(plain) + bytes([2, 0xB0 + number % 16])
        ordinary = framing.seal(plain, before)[:-1]
        packet = sheet_number.numbered(ordinary, number % 16)
        assert packet == stuffed + check(stuffed, before)
        assert sheet_number.sheet_of(packet) == number % 16
        assert sheet_number.unnumbered(packet) == ordinary


def test_a_damaged_packet_is_refused_by_whichever_sheet_gets_it():
    rng = random.Random(2)
    refused = 0
    for plain, before in packets(2):
        packet = bytearray(sheet_number.numbered(framing.seal(plain, before)[:-1], 3))
        packet[rng.randrange(len(packet))] ^= 1 << rng.randrange(8)
        if sheet_number.sheet_of(packet) is not None:
            refused += 1
            with pytest.raises(PacketError):
                framing.unseal(sheet_number.unnumbered(bytes(packet)), before)
    assert refused > 40


def test_an_ordinary_packet_says_no_number():
    for plain, before in packets(3):
        assert sheet_number.sheet_of(framing.seal(plain, before)[:-1]) is None
    assert [sheet_number.sheet_of(b"\x02\xb1\x80\x80\x80"[-length:]) for length in range(1, 6)] == [None] * 5


@pytest.mark.parametrize("pulsed", [False, True])
def test_requests_are_numbered_in_either_form(pulsed):
    numbers = (1234567, 129 * 128 + 1)
    data = b"".join(protocol.encode_request(number, True, pulsed) for number in numbers)
    want = b"".join(request(number, True, 2 if pulsed else 4, bytes([2, 0xB5])) for number in numbers)
    assert sheet_number.numbered_requests(data, 5) == want


def test_a_host_that_knows_no_sheets_takes_nothing_for_a_frame_and_counts_all():
    reported = hello(Facts(SKIN, (1, 2)))
    frame = sheet_number.numbered(framing.seal(bytes(9) + b"\x50", SKIN.fingerprint[:2])[:-1], 1) + b"\0"
    before = Conversation("port")
    assert before.receive(reported + frame, 0.0) == []
    assert (before.stats.before_hello, before.stats.hellos, before.stats.damaged.total()) == (2, 0, 0)
    after = Conversation("port")
    assert len(after.receive(protocol.encode_hello(SKIN) + frame, 0.0)) == 1
    assert (after.stats.unknown_kinds, after.stats.frames, after.stats.damaged.total()) == (1, 0, 0)


def test_a_hello_tells_the_place_among_sheets():
    packet = hello(Facts(SKIN, (1, 3))).strip(b"\0")
    plain = framing.unseal(sheet_number.unnumbered(packet), b"")
    assert protocol.HelloReader().take(plain).place == (1, 3)
    of_three = protocol.encode_hello(SKIN, place=sheet_number.SheetPlace(1, 3))
    assert of_three.strip(b"\0") == sheet_number.unnumbered(packet)
    assert protocol.HelloReader().take(framing.unseal(hello(Facts(SKIN)).strip(b"\0"), b"")).place is None
    with pytest.raises(PacketError, match="sheet 3 of 3"):
        protocol.HelloReader().take(framing.unseal(protocol.encode_hello(SKIN, place=(3, 3)).strip(b"\0"), b""))
