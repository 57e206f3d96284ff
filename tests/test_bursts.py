"""No single bit flip and no burst of up to 16 bits, anywhere in a packet or its delimiter, passes as another packet."""

import pytest
from bursts import BURSTS, wrong_packets, wrong_packets_one_by_one
from frames import frame, moments, receiver
from wire import Wire

from contactfpga import Skin, protocol

REFERENCE = Skin()
LARGE = Skin(rows=32, columns=32, settle_us=50.0)
BITMAP = Skin(rows=12, columns=16, report="cells", settle_us=10.0)


def check(packets, skin, record_property):
    accepts = receiver(skin)
    for packet, following in packets:
        assert accepts(packet[:-1])
        assert accepts(following[:-1])
        assert wrong_packets(packet, following, accepts) == []
    record_property("cases", sum(8 * len(packet) * len(BURSTS) for packet, _ in packets))


@pytest.mark.parametrize("zones", range(4))
def test_no_burst_in_a_frame_of_the_reference_skin_passes(rng, zones, record_property):
    packets = [(frame(rng, REFERENCE, zones), frame(rng, REFERENCE, rng.randrange(4))) for _ in range(8)]
    check(packets, REFERENCE, record_property)


@pytest.mark.parametrize("zones", [0, 1, 2, 3, 60])
def test_no_burst_in_a_frame_of_32x32_passes(rng, zones, record_property):
    check([(frame(rng, LARGE, zones), frame(rng, LARGE, 1))], LARGE, record_property)


def test_no_burst_in_a_bitmap_passes(rng, record_property):
    check([(frame(rng, BITMAP), frame(rng, BITMAP)) for _ in range(4)], BITMAP, record_property)


def test_no_burst_in_a_hello_passes_nor_in_the_frame_behind_it(rng, record_property):
    cylinder = REFERENCE.replace(surface="cylinder", radius_mm=60.0, send="on_change")
    hellos = [Wire(skin).hello() for skin in (REFERENCE, cylinder)]
    packets = [(hello, frame(rng, REFERENCE, 1)) for hello in hellos]
    packets += [(frame(rng, REFERENCE, 1), hello) for hello in hellos]
    check(packets, REFERENCE, record_property)


@pytest.mark.parametrize("bits", [1, 7])
def test_what_a_weak_check_lets_pass_is_found_all_of_it(rng, bits, monkeypatch, record_property):
    whole = protocol.check_bytes

    def weak(stuffed):
        bit = whole(stuffed)[0] & 1
        return bytes([1, 1, 2 | bit]) if bits == 1 else whole(stuffed)[:1] + b"\x80\x80"

    def accepts(packet):
        return len(packet) >= 5 and packet[-3:] == weak(packet[:-3])

    monkeypatch.setattr(protocol, "check_bytes", weak)
    wire = Wire(REFERENCE)
    packet, following = (
        protocol.seal(wire.plain_zones(moments(rng, REFERENCE, zones), sequence=7 * zones)) for zones in (2, 1)
    )
    short = BURSTS[: 1 << 9]
    found = wrong_packets(packet, following, accepts, short)
    assert sorted(found) == sorted(wrong_packets_one_by_one(packet, following, accepts, short))
    cases = 8 * len(packet) * len(short)
    assert len(found) == pytest.approx(cases / 2**bits, rel=0.2)
    lengths = {len(piece) for _, _, piece in found}
    assert max(lengths) > len(packet)  # the delimiter was hit
    assert bits > 1 or min(lengths) < len(packet) - 1  # a zero byte was made
    record_property("cases", cases)
