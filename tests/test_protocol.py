"""Packets: what is decoded, against an encoder written from docs/protocol.md, and what is refused."""

import itertools
import struct

import numpy as np
import pytest
from cobs import cobs
from hypothesis import given, settings
from hypothesis import strategies as st
from wire import HELLO, Wire, check, last_byte, seal

from contactfpga import Skin, protocol
from contactfpga.derived import Derived
from contactfpga.protocol import PacketError

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
        "stuck": st.integers(0, 7),
        "flags": st.sampled_from([(), ("requested",)]),
    }
)


def decoded(packet, skin):
    assert packet.endswith(b"\0")
    assert packet.count(b"\0") == 1
    return protocol.decode_frame(protocol.unseal(packet[:-1]), Derived(skin))


def fields(frame):
    return {
        "time": frame.time_us,
        "sequence": frame.sequence,
        "overwritten": frame.overwritten,
        "stuck": frame.stuck,
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


@given(
    skins() | skins(report="barycenter", barycenter_bits=0) | skins(report="barycenter", barycenter_bits=7),
    st.sampled_from(["always", "on_change"]),
    st.floats(0.015625, 1000.0, width=32),
)
@settings(max_examples=100, deadline=None)
def test_hellos_arrive(skin, send, pitch_y_mm):
    skin = skin.replace(pitch_y_mm=pitch_y_mm)
    if send == "on_change" and Derived(skin).frame_clocks < 100_000 * 12:
        skin = skin.replace(send=send)
    packet = Wire(skin).hello()
    assert packet == protocol.encode_hello(skin)
    assert len(packet) <= 32
    hello = protocol.decode_hello(protocol.unseal(packet[:-1]))
    assert hello.fingerprint == skin.fingerprint
    told = hello.skin()
    told_exactly = ("rows", "columns", "connectivity", "report", "barycenter_bits", "zone_capacity")
    for name in (*told_exactly, "pitch_x_mm", "radius_mm"):
        assert getattr(told, name) == getattr(skin, name)
    assert told.pitch_y_mm == pytest.approx(skin.pitch_y_mm, rel=1e-6)
    for name in ("area_bits", "sum_x_bits", "sum_y_bits", "zones_bits", "record_bytes", "trailer_bytes"):
        assert getattr(Derived(told), name) == getattr(Derived(skin), name)


def test_a_cylinder_says_its_radius():
    skin = Skin(surface="cylinder", radius_mm=123.4)
    hello = protocol.decode_hello(protocol.unseal(protocol.encode_hello(skin)[:-1]))
    assert hello.radius_mm == 123.4
    assert hello.skin().surface == "cylinder"


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
        protocol.decode_frame(protocol.unseal(seal(plain)[:-1]), Derived(skin))
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
        (last_byte(1), REFERENCE, "length"),
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
        (WIRE.plain_zones(ONE)[:-1] + last_byte(3), REFERENCE, "kind"),
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
        assert plain[0] & (1 << Derived(skin).record_bits[0]) - 1 == record
        assert decoded(seal(plain), skin).barycenters.tolist() == [[area, columns - 1, 0]]


@pytest.mark.parametrize("version", [0, 2, 7])
def test_another_version_says_which(version):
    error = refusal(WIRE.plain_zones(ONE, version=version))
    assert (error.reason, error.version) == ("version", version)
    assert f"version {version}" in str(error)


UNKNOWN = (0x0A, 0x50, 0xD0, 0xFF)
"""Options that no board says: divided cells, 9 fraction bits, and bits without meaning."""


@pytest.mark.parametrize(
    ("plain", "reason"),
    [
        (WIRE.plain_hello()[1:], "length"),
        (WIRE.plain_hello() + last_byte(HELLO), "length"),
        *((WIRE.plain_hello()[:2] + bytes([options]) + WIRE.plain_hello()[3:], "content") for options in UNKNOWN),
    ],
)
def test_hellos_that_cannot_be(plain, reason):
    with pytest.raises(PacketError) as caught:
        protocol.decode_hello(protocol.unseal(seal(plain)[:-1]))
    assert caught.value.reason == reason


@pytest.mark.parametrize("rows", [0, 65, 255])
def test_a_hello_of_an_impossible_skin_is_refused_by_the_receiver(rows):
    from contactfpga.receiver import Receiver

    plain = bytes([rows]) + WIRE.plain_hello()[1:]
    receiver = Receiver("x")
    receiver.feed(WIRE.zones([]) + seal(plain), 0.0)
    assert receiver.hello is None
    assert receiver.stats.damaged == {"content": 1}


@pytest.mark.parametrize("pitch", [float("nan"), float("inf"), 0.0, -1.0])
def test_a_hello_without_a_usable_pitch_is_refused(pitch):
    from contactfpga.receiver import Receiver

    plain = WIRE.plain_hello()
    receiver = Receiver("x")
    receiver.feed(WIRE.zones([]) + seal(plain[:5] + struct.pack("<f", pitch) + plain[9:]), 0.0)
    assert receiver.hello is None
    assert receiver.stats.damaged == {"content": 1}


@pytest.mark.parametrize("packet", [b"", b"\x01", b"\x80\x80\x80", b"\x01\x80\x80\x80"])
def test_packets_too_short_to_be_one(packet):
    with pytest.raises(PacketError) as caught:
        protocol.unseal(packet)
    assert caught.value.reason == "framing"


@pytest.mark.parametrize("stuffed", [b"\x05abc", b"\x01\x01\x09", b"\xff" + b"a" * 253])
def test_blocks_that_do_not_fit(stuffed):
    with pytest.raises(PacketError) as caught:
        protocol.unseal(stuffed + check(stuffed))
    assert caught.value.reason == "framing"


def test_a_wrong_check_byte_is_told_apart():
    packet = WIRE.zones(ONE)[:-1]
    for index in (-3, -2, -1):
        wrong = bytearray(packet)
        wrong[index] ^= 0x40
        with pytest.raises(PacketError) as caught:
            protocol.unseal(bytes(wrong))
        assert caught.value.reason == "crc"
