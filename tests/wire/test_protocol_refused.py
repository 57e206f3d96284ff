"""Packets that the host refuses."""

import struct

import numpy as np
import pytest
from frames import frame_in
from wire import (
    FINGERPRINT,
    HELLO,
    NAME,
    PITCH,
    RATES,
    SHEET,
    STATE,
    Wire,
    check,
    field,
    last_byte,
    old_frame,
    old_hello,
)

from contactfpga import Skin
from contactfpga.skin.derived import LONGEST_PACKET, Widths
from contactfpga.wire import protocol
from contactfpga.wire.protocol import HelloReader, OldPacket, PacketError

SLOW = {"settle_us": 1000.0}
REFERENCE = Skin()


# ---- what is refused


def refusal(plain, skin=REFERENCE):
    with pytest.raises(PacketError) as caught:
        protocol.decode_frame(plain, Widths(skin.sheet))
    return caught.value


WIRE = Wire(REFERENCE)
SMALL = Skin(rows=3, columns=5, **SLOW)  # its records and bitmap rows have bits to spare
BITMAP = SMALL.replace(report="cells")
MAP = BITMAP.replace(ruler=9, harder=(2,), guard=True, precharge_us=1.0)
DIVIDED = SMALL.replace(report="barycenter", barycenter_bits=1)  # area 4, x 4, y 3 bits
FULL = REFERENCE.replace(zone_capacity=2)
ONE = [(4, 10, 6)]


def unused_bits(plain, index):
    """``plain`` with the highest bit of one byte set."""
    return plain[:index] + bytes([plain[index] | 0x80]) + plain[index + 1 :]


@pytest.mark.parametrize(
    ("plain", "skin", "reason"),
    [
        (WIRE.plain_zones(ONE, zones=0), REFERENCE, "length"),
        (WIRE.plain_zones([], zones=1), REFERENCE, "length"),
        (WIRE.plain_zones(ONE)[1:], REFERENCE, "length"),
        (last_byte(5), REFERENCE, "length"),
        (WIRE.plain_zones(ONE, flags=["overflow"]), REFERENCE, "length"),
        (Wire(FULL).plain_zones(ONE * 2, zones=3, cells=12), FULL, "length"),
        (Wire(FULL).plain_zones(ONE, zones=3, cells=12, flags=["overflow"]), FULL, "length"),
        (WIRE.plain_zones(ONE * 65), REFERENCE, "length"),
        (Wire(FULL).plain_zones(ONE * 2, zones=65, cells=99, flags=["overflow"]), FULL, "content"),
        (Wire(FULL).plain_zones(ONE * 2, zones=3, flags=["overflow"]), FULL, "content"),
        (Wire(MAP).plain_cells([[0, 1, 2, 3, 0]] * 3), MAP, "content"),
        (Wire(MAP).plain_cells([[0, 1, 2, 3, 0]] * 3, flags=["mismatch"]), MAP, "content"),
        (unused_bits(Wire(MAP).plain_cells([[2] * 5] * 3), 1), MAP, "content"),
        (Wire(MAP).plain_cells([[2] * 5] * 3, cells=14), MAP, "content"),
        (Wire(BITMAP).plain_cells([[1] * 5] * 3), MAP, "length"),
        (WIRE.plain_zones(ONE, cells=3), REFERENCE, "content"),
        (WIRE.plain_zones([(0, 0, 0)]), REFERENCE, "content"),
        (WIRE.plain_zones([(1, 16, 0)]), REFERENCE, "content"),
        (WIRE.plain_zones([(1, 0, 16)]), REFERENCE, "content"),
        (WIRE.plain_zones([(200, 0, 0), (57, 0, 0)]), REFERENCE, "content"),
        (unused_bits(WIRE.plain_zones(ONE), 3), REFERENCE, "content"),
        (WIRE.plain_cells([[0] * 16] * 16), REFERENCE, "kind"),
        (WIRE.plain_zones(ONE)[:-1] + last_byte(9), REFERENCE, "kind"),
        (Wire(DIVIDED).plain_zones([(16, 0, 0)], cells=0), DIVIDED, "content"),
        (Wire(DIVIDED).plain_zones([(1, 9, 0)]), DIVIDED, "content"),
        (Wire(DIVIDED).plain_zones([(1, 0, 5)]), DIVIDED, "content"),
        (Wire(DIVIDED).plain_zones([(9, 8, 4)], cells=8), DIVIDED, "content"),
        (unused_bits(Wire(DIVIDED).plain_zones([(9, 8, 4)]), 1), DIVIDED, "content"),
        (Wire(DIVIDED).plain_zones([]), SMALL, "kind"),
        (Wire(BITMAP).plain_zones([]), BITMAP, "kind"),
        (Wire(BITMAP).plain_cells([[1] * 5] * 2), BITMAP, "length"),
        (Wire(BITMAP).plain_cells([[1] * 5] * 3, cells=14), BITMAP, "content"),
        (Wire(BITMAP).plain_cells([[1] * 5] * 3, zones=1), BITMAP, "content"),
        (unused_bits(Wire(BITMAP).plain_cells([[1] * 5] * 3), 1), BITMAP, "content"),
        (Wire(BITMAP).plain_cells([[1] * 5] * 3, flags=["overflow"]), BITMAP, "length"),
    ],
)
def test_frames_that_contradict_themselves_are_refused(plain, skin, reason):
    assert refusal(plain, skin).reason == reason


def test_a_mismatch_on_the_board_is_passed_on():
    frame = frame_in(WIRE.zones(ONE, cells=7, flags=["mismatch"]), REFERENCE)
    assert (frame.cells, frame.moments.tolist()) == (7, [[4, 10, 6]])


def test_all_cells_of_a_sheet_are_sent_as_0_where_that_saves_a_bit():
    for rows, columns, record in ((4, 8, 0), (4, 7, 28), (1, 1, 1), (1, 2, 0)):
        skin = Skin(rows=rows, columns=columns, report="barycenter", barycenter_bits=0, **SLOW)
        area = rows * columns
        plain = Wire(skin).plain_zones([(area, columns - 1, 0)])
        assert plain[0] & (1 << Widths(skin.sheet).record_bits[0]) - 1 == record
        assert frame_in(Wire(skin).seal(plain), skin).barycenters.tolist() == [[area, columns - 1, 0]]


@pytest.mark.parametrize(("packet", "hello"), [(old_hello(), True), (old_frame(), False)])
def test_packets_of_protocol_1_say_so(packet, hello):
    with pytest.raises(OldPacket) as caught:
        protocol.unseal(packet[:-1], protocol.check_prefix(REFERENCE))
    assert caught.value.hello == hello


def test_frames_of_a_board_with_another_skin_fail_their_check():
    other = REFERENCE.replace(pitch_x_mm=20.0)
    with pytest.raises(PacketError) as caught:
        protocol.unseal(Wire(other).zones(ONE)[:-1], protocol.check_prefix(REFERENCE))
    assert caught.value.reason == "crc"


def changed(kind, value):
    return WIRE.plain_hello(facts=WIRE.facts() | {kind: value})


def without(kind):
    return WIRE.plain_hello(facts={key: value for key, value in WIRE.facts().items() if key != kind})


def with_byte(data, index, value):
    return data[:index] + bytes([value]) + data[index + 1 :]


SIZES = WIRE.facts()[SHEET]
STATE_DIGIT = len(field(SHEET, SIZES)) + 2


@pytest.mark.parametrize(
    ("plain", "reason"),
    [
        (WIRE.plain_hello()[:-2] + last_byte(HELLO), "length"),
        (WIRE.plain_hello()[:-1] + b"\x07\x01x" + last_byte(HELLO), "length"),
        (WIRE.plain_hello()[:-1] + b"\x07" + last_byte(HELLO), "length"),
        (WIRE.plain_hello()[1:], "content"),
        (last_byte(HELLO), None),
        *((with_byte(WIRE.plain_hello(), index, 0x42), "crc") for index in (9, 35, 50, -3)),
        *((without(kind), "content") for kind in (PITCH, FINGERPRINT, RATES)),
        (b"".join(part for part in WIRE.hello_fields() if part[0] != STATE) + last_byte(HELLO), "content"),
        (with_byte(WIRE.plain_hello(), STATE_DIGIT, 0x42), "content"),
        (changed(SHEET, SIZES[:-1]), "content"),
        (changed(FINGERPRINT, b"short"), "content"),
        *((changed(SHEET, with_byte(SIZES, 0, rows)), "content") for rows in (0, 65, 255)),
        *((changed(SHEET, with_byte(SIZES, 1, columns)), "content") for columns in (0, 65, 255)),
        *((changed(SHEET, with_byte(SIZES, 2, connectivity)), "content") for connectivity in (0, 6)),
        *((changed(SHEET, with_byte(SIZES, 3, report)), "content") for report in (3, 255)),
        *((changed(SHEET, with_byte(SIZES, 4, bits)), "content") for bits in (4, 255)),
        *((changed(SHEET, with_byte(SIZES, index, 2)), "content") for index in (5, 8)),
        *((changed(SHEET, with_byte(SIZES, 6, capacity)), "content") for capacity in (0, 65)),
        *((changed(PITCH, struct.pack("<dd", pitch, 1.0)), "content") for pitch in (float("nan"), np.inf, 0.0, -1.0)),
        (changed(4, struct.pack("<d", -40.0)), "content"),
        (changed(RATES, struct.pack("<II", 0, 9600)), "content"),
        (changed(NAME, b"\xff"), "content"),
    ],
)
def test_hellos_that_cannot_be(plain, reason):
    if reason is None:
        assert HelloReader().take(plain) is None
        return
    with pytest.raises(PacketError) as caught:
        HelloReader().take(plain)
    assert caught.value.reason == reason


def test_no_packet_is_longer_than_the_reader_expects():
    longest = 0
    for rows, columns in ((64, 64), (64, 63), (1, 64), (33, 64)):
        for report in ("moments", "cells", "barycenter"):
            around = {"surface": "cylinder", "radius_mm": 99.0, "closed": True} if report != "barycenter" else {}
            for surface in ({}, around):
                shape = {"rows": rows, "columns": columns, "connectivity": 4, "settle_us": 10_000.0}
                skin = Skin(**shape, report=report, extent=report != "cells", **surface)
                capacity = skin.max_zones() if report != "cells" else None
                longest = max(longest, Widths(skin.replace(zone_capacity=capacity).sheet).max_frame_bytes)
    assert longest == LONGEST_PACKET


@pytest.mark.parametrize("packet", [b"", b"\x01", b"\x80\x80\x80", b"\x01\x80\x80\x80"])
def test_packets_too_short_to_be_one(packet):
    with pytest.raises(PacketError) as caught:
        protocol.unseal(packet, b"")
    assert caught.value.reason == "framing"


@pytest.mark.parametrize("stuffed", [b"\x05ab\x40", b"\x01\x01\x49", b"\xff" + b"A" * 253])
def test_blocks_that_do_not_fit(stuffed):
    with pytest.raises(PacketError) as caught:
        protocol.unseal(stuffed + check(stuffed), b"")
    assert caught.value.reason == "framing"


def test_a_wrong_check_byte_is_told_apart():
    packet = WIRE.zones(ONE)[:-1]
    for index in (-3, -2, -1):
        wrong = bytearray(packet)
        wrong[index] ^= 0x40
        with pytest.raises(PacketError) as caught:
            protocol.unseal(bytes(wrong), WIRE.prefix)
        assert caught.value.reason == "crc"
