"""Packets: what is decoded, against an encoder written from docs/protocol.md, and what is refused."""

import itertools
import struct

import numpy as np
import pytest
from cobs import cobs
from hypothesis import given, settings
from hypothesis import strategies as st
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
from contactfpga.skin.widths import LONGEST_PACKET, Widths
from contactfpga.wire import protocol
from contactfpga.wire.protocol import HelloReader, OldPacket, PacketError

SLOW = {"settle_us": 1000.0}
REFERENCE = Skin()


def skins(**fixed):
    return st.builds(
        Skin,
        rows=st.integers(1, 64),
        columns=st.integers(1, 64),
        connectivity=st.sampled_from([4, 8]),
        settle_us=st.just(1000.0),
        **{name: st.just(value) for name, value in fixed.items()},
    )


@st.composite
def moments(draw, skin, most=40):
    rows = []
    for _ in range(draw(st.integers(0, min(most, skin.zone_capacity)))):
        area = draw(st.integers(1, max(1, skin.rows * skin.columns // (2 * most))))
        x = draw(st.integers(0, area * (skin.columns - 1)))
        rows.append((area, x, draw(st.integers(0, area * (skin.rows - 1)))))
    return rows


TRAILERS = st.fixed_dictionaries(
    {
        "time": st.integers(0, (1 << 24) - 1),
        "sequence": st.integers(0, 255),
        "overwritten": st.integers(0, 15),
        "heard": st.integers(0, 7),
        "flags": st.sampled_from([(), ("fault",)]),
    }
)


def decoded(packet, skin):
    assert packet.endswith(b"\0")
    assert packet.count(b"\0") == 1
    return protocol.decode_frame(unsealed(packet, skin), Widths(skin.sheet))


def unsealed(packet, skin):
    return protocol.unseal(packet.strip(b"\0"), protocol.check_prefix(skin))


def fields(frame):
    return {
        "time": frame.time_us,
        "sequence": frame.sequence,
        "overwritten": frame.overwritten,
        "heard": frame.heard,
        "flags": tuple(sorted(frame.flags)),
    }


# ---- what is sent arrives


@given(st.data(), skins(), TRAILERS)
@settings(max_examples=200, deadline=None)
def test_zones_arrive_exactly(data, skin, trailer):
    rows = data.draw(moments(skin))
    if sum(row[0] for row in rows) > skin.rows * skin.columns:
        rows = rows[:1]
    frame = decoded(Wire(skin).zones(rows, **trailer), skin)
    assert frame.moments.tolist() == [list(row) for row in rows]
    assert fields(frame) == trailer
    assert (frame.zones, frame.cells) == (len(rows), sum(row[0] for row in rows))
    assert frame.bitmap is None


@given(st.data(), skins(report="barycenter"), st.integers(0, 8), TRAILERS)
@settings(max_examples=200, deadline=None)
def test_barycenters_arrive_exactly(data, skin, fraction_bits, trailer):
    skin = skin.replace(barycenter_bits=fraction_bits)
    x, y = (st.integers(0, (lines - 1) * 2**fraction_bits) for lines in (skin.columns, skin.rows))
    most = min(20, skin.zone_capacity)
    area = st.integers(1, max(1, skin.rows * skin.columns // 20))
    rows = data.draw(st.lists(st.tuples(area, x, y), max_size=most))
    if sum(row[0] for row in rows) > skin.rows * skin.columns:
        rows = [(skin.rows * skin.columns, *rows[0][1:])]
    frame = decoded(Wire(skin).zones(rows, **trailer), skin)
    assert frame.barycenters.tolist() == [list(row) for row in rows]
    assert fields(frame) == trailer
    assert (frame.zones, frame.cells) == (len(rows), sum(row[0] for row in rows))
    assert (frame.bitmap, len(frame.moments)) == (None, 0)


@given(st.data(), skins(report="cells"), TRAILERS)
@settings(max_examples=100, deadline=None)
def test_bitmaps_arrive_exactly(data, skin, trailer):
    seed = data.draw(st.integers(0, 1 << 32))
    bitmap = np.random.default_rng(seed).random((skin.rows, skin.columns)) < 0.3
    frame = decoded(Wire(skin).cells(bitmap.tolist(), **trailer), skin)
    assert np.array_equal(frame.bitmap, bitmap)
    assert fields(frame) == trailer
    assert (frame.zones, frame.cells) == (0, int(bitmap.sum()))
    assert len(frame.moments) == 0


NAMES = st.text(max_size=8).filter(lambda name: name.isprintable() and name == name.strip())


@given(
    skins() | skins(report="barycenter", barycenter_bits=0) | skins(report="cells", diodes="none"),
    st.sampled_from(["always", "on_change"]),
    st.floats(0.01, 1000.0),
    NAMES,
    st.fixed_dictionaries(
        {"sent": st.integers(0, 2**49 - 1), "epoch": st.integers(0, 2**28 - 1), "stuck": st.integers(0, 7)}
        | {"heard": st.integers(0, 2**21 - 1)}
    ),
)
@settings(max_examples=150, deadline=None)
def test_hellos_arrive(skin, send, pitch_y_mm, name, state):
    skin = skin.replace(pitch_y_mm=pitch_y_mm, name=name)
    if send == "on_change" and skin.rows < 60:
        skin = skin.replace(send=send)
    packet = Wire(skin).hello(**state)
    assert packet == protocol.encode_hello(skin, **state)
    hello = HelloReader().take(unsealed(packet, skin))
    assert hello.sheet == skin.sheet
    told = (hello.fingerprint, hello.name, hello.clock_hz, hello.baud, hello.send)
    assert told == (skin.fingerprint, name, skin.clock_hz, skin.baud, skin.send)
    assert {key: getattr(hello, key) for key in state} == state


def test_a_hello_of_the_reference_skin_takes_81_bytes():
    assert len(protocol.encode_hello(REFERENCE)) == 81


def test_a_cylinder_says_its_radius_to_the_last_bit():
    """A Skin whose columns nearly meet around the link, which a rounded radius would make meet."""
    skin = Skin(rows=2, surface="cylinder", radius_mm=25.464791)
    assert HelloReader().take(unsealed(protocol.encode_hello(skin), skin)).sheet.radius_mm == 25.464791


def test_later_boards_can_say_more():
    facts = WIRE.facts()
    facts[SHEET] += b"more"
    facts[RATES] += b"\0"
    facts[99] = b"unheard of"
    hello = HelloReader().take(WIRE.plain_hello(facts=facts, sent=7))
    assert (hello.sheet, hello.sent, hello.fingerprint) == (REFERENCE.sheet, 7, REFERENCE.fingerprint)


def test_a_hello_may_come_in_several_packets():
    parts = WIRE.hello_fields(sent=300, facts=WIRE.facts() | {NAME: b"arm"})
    for cut in range(1, len(parts)):
        reader = HelloReader()
        assert reader.take(b"".join(parts[:cut]) + last_byte(HELLO)) is None
        hello = reader.take(b"".join(parts[cut:]) + last_byte(HELLO))
        assert (hello.name, hello.sent) == ("arm", 300)


def test_a_hello_whose_middle_was_lost_is_refused_and_the_next_one_is_taken():
    parts = WIRE.hello_fields()
    reader = HelloReader()
    reader.take(b"".join(parts[:2]) + last_byte(HELLO))
    with pytest.raises(PacketError) as caught:
        reader.take(parts[-1] + last_byte(HELLO))
    assert caught.value.reason == "crc"
    with pytest.raises(PacketError, match="without its beginning"):
        reader.take(parts[-1] + last_byte(HELLO))
    reader.take(parts[0] + last_byte(HELLO))
    assert reader.take(WIRE.plain_hello()).sheet == REFERENCE.sheet


@given(st.binary(max_size=700) | st.lists(st.sampled_from([b"\0", b"a" * 253, b"b" * 254, b"c"])).map(b"".join))
@settings(max_examples=300, deadline=None)
def test_stuffing_and_check_are_the_documented_ones(data):
    stuffed = protocol.cobs_encode(data)
    assert stuffed == cobs.encode(data)
    assert protocol.cobs_decode(stuffed) == data
    assert protocol.check_bytes(stuffed) == check(stuffed)


def test_check_bytes_of_the_catalogue():
    """CRC-16/MCRF4XX of 123456789 is 0x6F91."""
    assert protocol.check_bytes(b"123456789") == bytes([0x80 | 0x11, 0x80 | 0x6F91 >> 7 & 0x7F, 0x80 | 0x6F91 >> 14])


@pytest.mark.parametrize(("size", "zone_bytes", "frame_bytes"), [(16, 4, 13), (32, 5, 14), (64, 6, 14)])
@pytest.mark.parametrize("connectivity", [4, 8])
def test_bytes_on_the_wire(size, zone_bytes, frame_bytes, connectivity):
    skin = Skin(rows=size, columns=size, connectivity=connectivity, **SLOW)
    wire = Wire(skin)
    lengths = [len(wire.zones([(1, 1, 1)] * zones)) for zones in range(4)]
    assert lengths[0] <= frame_bytes
    assert [after - before for before, after in itertools.pairwise(lengths)] == [zone_bytes] * 3


@pytest.mark.parametrize(("size", "zone_bytes"), [(16, 3), (32, 4), (64, 4)])
def test_bytes_of_a_barycenter_on_the_wire(size, zone_bytes):
    wire = Wire(Skin(rows=size, columns=size, report="barycenter", **SLOW))
    lengths = [len(wire.zones([(1, 1, 1)] * zones)) for zones in range(4)]
    assert [after - before for before, after in itertools.pairwise(lengths)] == [zone_bytes] * 3


# ---- what is refused


def refusal(plain, skin=REFERENCE):
    with pytest.raises(PacketError) as caught:
        protocol.decode_frame(plain, Widths(skin.sheet))
    return caught.value


WIRE = Wire(REFERENCE)
SMALL = Skin(rows=3, columns=5, **SLOW)  # its records and bitmap rows have bits to spare
BITMAP = SMALL.replace(report="cells")
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
        (WIRE.plain_zones(ONE, zones=2), REFERENCE, "length"),
        (WIRE.plain_zones([], zones=1), REFERENCE, "length"),
        (WIRE.plain_zones(ONE)[1:], REFERENCE, "length"),
        (b"\0" + WIRE.plain_zones(ONE), REFERENCE, "length"),
        (WIRE.plain_zones([])[1:], REFERENCE, "length"),
        (last_byte(5), REFERENCE, "length"),
        (WIRE.plain_zones(ONE, flags=["overflow"]), REFERENCE, "length"),
        (Wire(FULL).plain_zones(ONE * 2, zones=3, cells=12), FULL, "length"),
        (Wire(FULL).plain_zones(ONE, zones=3, cells=12, flags=["overflow"]), FULL, "length"),
        (Wire(FULL).plain_zones(ONE * 3), FULL, "length"),
        (WIRE.plain_zones(ONE * 65), REFERENCE, "length"),
        (Wire(FULL).plain_zones(ONE * 2, zones=65, cells=99, flags=["overflow"]), FULL, "content"),
        (Wire(FULL).plain_zones(ONE * 2, zones=3, flags=["overflow"]), FULL, "content"),
        (WIRE.plain_zones(ONE, cells=5), REFERENCE, "content"),
        (WIRE.plain_zones(ONE, cells=3), REFERENCE, "content"),
        (WIRE.plain_zones([], cells=1), REFERENCE, "content"),
        (WIRE.plain_zones([(0, 0, 0)]), REFERENCE, "content"),
        (WIRE.plain_zones([(1, 16, 0)]), REFERENCE, "content"),
        (WIRE.plain_zones([(1, 0, 16)]), REFERENCE, "content"),
        (WIRE.plain_zones([(200, 0, 0), (57, 0, 0)]), REFERENCE, "content"),
        (unused_bits(WIRE.plain_zones(ONE), 3), REFERENCE, "content"),
        (WIRE.plain_cells([[0] * 16] * 16), REFERENCE, "kind"),
        (WIRE.plain_hello(), REFERENCE, "kind"),
        (WIRE.plain_zones(ONE)[:-1] + last_byte(9), REFERENCE, "kind"),
        (Wire(DIVIDED).plain_zones([(16, 0, 0)], cells=0), DIVIDED, "content"),
        (Wire(DIVIDED).plain_zones([(1, 9, 0)]), DIVIDED, "content"),
        (Wire(DIVIDED).plain_zones([(1, 0, 5)]), DIVIDED, "content"),
        (Wire(DIVIDED).plain_zones([(9, 8, 4)], cells=8), DIVIDED, "content"),
        (unused_bits(Wire(DIVIDED).plain_zones([(9, 8, 4)]), 1), DIVIDED, "content"),
        (Wire(SMALL).plain_zones([]), DIVIDED, "kind"),
        (Wire(DIVIDED).plain_zones([]), SMALL, "kind"),
        (Wire(BITMAP).plain_zones([]), BITMAP, "kind"),
        (Wire(BITMAP).plain_cells([[1] * 5] * 2), BITMAP, "length"),
        (Wire(BITMAP).plain_cells([[1] * 5] * 4, cells=15), BITMAP, "length"),
        (Wire(BITMAP).plain_cells([[1] * 5] * 3, cells=14), BITMAP, "content"),
        (Wire(BITMAP).plain_cells([[1] * 5] * 3, zones=1), BITMAP, "content"),
        (unused_bits(Wire(BITMAP).plain_cells([[1] * 5] * 3), 1), BITMAP, "content"),
        (Wire(BITMAP).plain_cells([[1] * 5] * 3, flags=["overflow"]), BITMAP, "length"),
    ],
)
def test_frames_that_contradict_themselves_are_refused(plain, skin, reason):
    assert refusal(plain, skin).reason == reason


def test_a_mismatch_on_the_board_is_passed_on():
    frame = decoded(WIRE.zones(ONE, cells=7, flags=["mismatch"]), REFERENCE)
    assert (frame.cells, frame.moments.tolist()) == (7, [[4, 10, 6]])


def test_all_cells_of_a_sheet_are_sent_as_0_where_that_saves_a_bit():
    for rows, columns, record in ((4, 8, 0), (4, 7, 28), (1, 1, 1), (1, 2, 0)):
        skin = Skin(rows=rows, columns=columns, report="barycenter", barycenter_bits=0, **SLOW)
        area = rows * columns
        plain = Wire(skin).plain_zones([(area, columns - 1, 0)])
        assert plain[0] & (1 << Widths(skin.sheet).record_bits[0]) - 1 == record
        assert decoded(Wire(skin).seal(plain), skin).barycenters.tolist() == [[area, columns - 1, 0]]


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
                skin = Skin(**shape, report=report, **surface)
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
