"""Bytes in, zones out: chunks, counters and the device time."""

import random
from types import SimpleNamespace

import pytest
from wire import Wire, last_byte, seal

import contactfpga
from contactfpga.commands.zones import status
from contactfpga.receiver import Receiver, Stats

SKIN = contactfpga.Skin()


def test_chunks_do_not_matter():
    wire, rng = Wire(SKIN), random.Random(3)
    stream = wire.hello() + b"".join(
        wire.zones([(5, 5 * (i % 16), i % 76)], sequence=i, time=i * 96) for i in range(300)
    )
    for _ in range(20):
        receiver, items, rest = Receiver("x"), [], stream
        while rest:
            cut = rng.randrange(1, 60)
            items += receiver.feed(rest[:cut], 0.0)
            rest = rest[cut:]
        assert [zones.sequence for zones in items[1:]] == [i % 256 for i in range(300)]
        assert receiver.stats.lost == 0
        assert not receiver.stats.damaged


def test_noise_without_a_single_zero_keeps_no_more_than_a_packet():
    receiver = Receiver("x")
    for _ in range(100):
        receiver.feed(b"\xaa" * 4096, 0.0)
        assert len(receiver._rest) < 20_000
    assert receiver.stats.damaged["noise"] > 10


def test_overflow_carries_what_fits_and_says_so():
    skin = SKIN.replace(zone_capacity=2)
    receiver, wire = Receiver("x"), Wire(skin)
    receiver.feed(wire.hello(), 0.0)
    (zones,) = receiver.feed(wire.zones([(2, 1, 0), (3, 3, 3)], cells=40, zones=17, flags=["overflow"]), 0.0)
    assert len(zones) == 2
    assert (zones.total_zones, zones.pressed, zones.flags) == (17, 40, {"overflow"})


def test_packets_without_a_meaning_are_counted():
    receiver, wire = Receiver("x", SKIN), Wire(SKIN)
    receiver.feed(wire.zones([]) + wire.hello(), 0.0)
    receiver.feed(seal(bytes(8) + last_byte(3)) + wire.cells([[0] * 16] * 16), 0.0)
    receiver.feed(wire.zones([], version=3), 0.0)
    assert receiver.stats.before_hello == 1
    assert receiver.stats.damaged == {"kind": 2}
    assert receiver.stats.foreign_version == 1


def frames_at(times_us, clock_s=None, live=True):
    """Unwrapped times of frames sampled at ``times_us`` of device time and read at ``clock_s``."""
    receiver, wire = Receiver("x", live=live), Wire(SKIN)
    receiver.feed(wire.hello(), 0.0)
    clock_s = clock_s or [time_us / 1e6 for time_us in times_us]
    return [
        receiver.feed(wire.zones([], time=time_us, sequence=index), now)[0].time_us
        for index, (time_us, now) in enumerate(zip(times_us, clock_s))
    ]


@pytest.mark.parametrize("live", [True, False])
def test_time_goes_on_past_its_24_bits(live):
    times = [round(i * 1.1e6) for i in range(60)]
    assert frames_at(times, live=live) == times


def test_gap_longer_than_the_wrap_is_bridged_by_the_clock():
    times = [5_000_000, 5_000_096, 905_000_000, 905_000_096, 4_000_000_000]
    assert frames_at(times) == times


def test_time_stands_frames_that_waited_some_seconds():
    times = [round(i * 0.5e6) for i in range(200)]
    late = [(i // 7 * 7 + 7) * 0.5 for i in range(200)]
    assert frames_at(times, late) == times


def gaps(pauses, send="always"):
    """Counters after frames every 96 us, with pauses of (frames, numbers of the sequence)."""
    skin = SKIN.replace(send=send)
    receiver, wire = Receiver("x"), Wire(skin)
    data, sequence, time_us = wire.hello(), 0, 0
    for frames, numbers in [(1, 1), (1, 1), *pauses, (1, 1)]:
        sequence, time_us = sequence + numbers, time_us + 96 * frames
        data += wire.zones([], sequence=sequence % 256, time=time_us)
    receiver.feed(data, 0.0)
    return receiver.stats.gaps, receiver.stats.lost


def test_a_pause_in_which_the_sequence_may_run_around_is_counted():
    assert gaps([(255, 255), (200, 200)]) == (0, 254 + 199)
    assert gaps([(256, 256)]) == (1, 255)  # one before as after: 255 frames are missing, or none
    assert gaps([(257, 257)]) == (1, 0)
    assert gaps([(2600, 2600), (30, 30), (257, 257)]) == (2, 39 + 29)
    assert gaps([(300, 1)]) == (1, 0)  # the board itself may have paused: `gaps` says what may be
    assert gaps([(300, 300)], send="on_change") == (0, 43)


def test_gaps_are_not_counted_before_a_step_is_known():
    receiver, wire = Receiver("x"), Wire(SKIN)
    receiver.feed(wire.hello() + wire.zones([], sequence=0, time=0) + wire.zones([], sequence=9, time=90_000), 0.0)
    assert (receiver.stats.gaps, receiver.stats.lost) == (0, 8)


def test_bytes_thrown_away_are_no_gap():
    receiver, wire = Receiver("x"), Wire(SKIN)
    receiver.feed(wire.hello() + b"".join(wire.zones([], sequence=n, time=96 * n) for n in range(3)), 0.0)
    receiver.discard(wire.zones([], sequence=3, time=300))
    receiver.feed(wire.zones([], sequence=40, time=900_000), 0.9)
    assert receiver.stats.gaps == 0


@pytest.mark.parametrize(("gaps", "told"), [(0, "3 lost"), (1, "3 or more lost")])
def test_the_line_below_a_frame_says_that_more_may_be_lost(gaps, told):
    receiver, wire = Receiver("x"), Wire(SKIN)
    *_, zones = receiver.feed(wire.hello() + wire.zones([]), 0.0)
    assert f"frames, {told}, " in status(SimpleNamespace(port="x", stats=Stats(lost=3, gaps=gaps)), zones, 160)
