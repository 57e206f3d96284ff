"""Packets: what is decoded, against an encoder written from docs/protocol.md, and what is refused."""

import itertools

import numpy as np
import pytest
from cobs import cobs
from frames import frame_in, unsealed
from hypothesis import given, settings
from hypothesis import strategies as st
from wire import (
    HELLO,
    NAME,
    RATES,
    SHEET,
    Wire,
    check,
    last_byte,
)

from contactfpga import Skin
from contactfpga.wire import protocol
from contactfpga.wire.protocol import HelloReader, PacketError

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
@settings(max_examples=100, deadline=None)
def test_zones_arrive_exactly(data, skin, trailer):
    rows = data.draw(moments(skin))
    if sum(row[0] for row in rows) > skin.rows * skin.columns:
        rows = rows[:1]
    frame = frame_in(Wire(skin).zones(rows, **trailer), skin)
    assert frame.moments.tolist() == [list(row) for row in rows]
    assert fields(frame) == trailer
    assert (frame.zones, frame.cells) == (len(rows), sum(row[0] for row in rows))
    assert frame.bitmap is None


@given(st.data(), skins(report="barycenter"), st.integers(0, 8), TRAILERS)
@settings(max_examples=100, deadline=None)
def test_barycenters_arrive_exactly(data, skin, fraction_bits, trailer):
    skin = skin.replace(barycenter_bits=fraction_bits)
    x, y = (st.integers(0, (lines - 1) * 2**fraction_bits) for lines in (skin.columns, skin.rows))
    most = min(20, skin.zone_capacity)
    area = st.integers(1, max(1, skin.rows * skin.columns // 20))
    rows = data.draw(st.lists(st.tuples(area, x, y), max_size=most))
    if sum(row[0] for row in rows) > skin.rows * skin.columns:
        rows = [(skin.rows * skin.columns, *rows[0][1:])]
    frame = frame_in(Wire(skin).zones(rows, **trailer), skin)
    assert frame.barycenters.tolist() == [list(row) for row in rows]
    assert fields(frame) == trailer
    assert (frame.zones, frame.cells) == (len(rows), sum(row[0] for row in rows))
    assert (frame.bitmap, len(frame.moments)) == (None, 0)


LEVELS = {"report": "cells", "guard": True, "precharge_us": 1.0, "ruler": 16}


@given(st.data(), skins(report="cells") | skins(harder=(4,), **LEVELS) | skins(harder=(4, 1), **LEVELS), TRAILERS)
@settings(max_examples=100, deadline=None)
def test_bitmaps_and_maps_arrive_exactly(data, skin, trailer):
    seed = data.draw(st.integers(0, 1 << 32))
    levels = np.maximum(0, np.random.default_rng(seed).integers(-3, skin.levels + 1, (skin.rows, skin.columns)))
    frame = frame_in(Wire(skin).cells(levels.tolist(), **trailer), skin)
    bitmap = levels > 0
    assert np.array_equal(frame.bitmap, bitmap)
    assert (frame.levels is None) if skin.levels == 1 else np.array_equal(frame.levels, levels)
    assert fields(frame) == trailer
    assert (frame.zones, frame.cells) == (0, int(bitmap.sum()))
    assert len(frame.moments) == 0


NAMES = st.text(max_size=8).filter(lambda name: name.isprintable() and name == name.strip())


@given(
    skins()
    | skins(report="barycenter", barycenter_bits=0)
    | skins(report="cells", diodes="none")
    | skins(harder=(4, 1), **LEVELS),
    st.sampled_from(["always", "on_change"]),
    st.floats(0.01, 1000.0),
    NAMES,
    st.fixed_dictionaries(
        {"sent": st.integers(0, 2**49 - 1), "epoch": st.integers(0, 2**28 - 1), "stuck": st.integers(0, 7)}
        | {"heard": st.integers(0, 2**21 - 1)}
    ),
)
@settings(max_examples=100, deadline=None)
def test_hellos_arrive(skin, send, pitch_y_mm, name, state):
    skin = skin.replace(pitch_y_mm=pitch_y_mm, name=name)
    if send == "on_change" and skin.rows < 60:
        skin = skin.replace(send=send)
    packet = Wire(skin).hello(**state)
    assert packet == protocol.encode_hello(skin, **state)
    hello = HelloReader().take(unsealed(packet, skin))
    assert hello.sheet == skin.sheet
    reported = (hello.fingerprint, hello.name, hello.clock_hz, hello.baud, hello.send)
    assert reported == (skin.fingerprint, name, skin.clock_hz, skin.baud, skin.send)
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
@settings(max_examples=150, deadline=None)
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


WIRE = Wire(REFERENCE)
