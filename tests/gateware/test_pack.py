"""The packer byte for byte against an encoder of its own, and clock by clock against docs/timing.md."""

import dataclasses

import pytest

from contactfpga import Skin
from contactfpga_hdl.link.pack import Packer

OFFSET_BITS = 11
SKINS = {
    "zones of 3 bytes": {"rows": 8, "columns": 8},
    "zones of 5 bytes": {"rows": 32, "columns": 32},
    "zones of 1 byte": {"rows": 1, "columns": 1},
    "rows of 1 byte": {"rows": 5, "columns": 8, "report": "cells"},
    "rows of 8 bytes": {"rows": 64, "columns": 64, "report": "cells"},
}


def skin_of(name):
    return Skin(settle_us=300, **SKINS[name])


def sizes(skin):
    """(bytes of an item, bits of the trailer's last two fields) from the tables of docs/protocol.md."""
    R, C = skin.rows, skin.columns
    area = (R * C).bit_length()
    zones = ((R + 1) // 2 * ((C + 1) // 2)).bit_length()  # 8-connectivity: one zone a 2x2 block
    sums = sum(max(1, value.bit_length()) for value in (R * sum(range(C)), C * sum(range(R))))
    item = -(-(area + sums) // 8) if skin.report == "moments" else -(-C // 8)
    return item, area, zones


@dataclasses.dataclass
class Frame:
    items: list  # of bytes
    trailer: dict  # its fields but the counters
    send: bool = True

    def plain(self, skin, verdict):
        _, area, zones = sizes(skin)
        fields = self.trailer | verdict
        widths = {"time": 24, "sequence": 8, "heard": 3, "cells": area, "zones": zones}
        widths["overwritten"] = overwritten_width(area, zones)
        widths |= {"overflow": 1, "mismatch": 1, "fault": 1}
        word = offset = 0
        for name, width in widths.items():
            word |= fields[name] << offset
            offset += width
        word |= (5 if skin.report == "moments" else 6) << offset + 1
        return b"".join(self.items) + word.to_bytes((offset + 5) // 8, "little")


def overwritten_width(area, zones):
    """Bits of the count of overwritten frames: those left up to whole bytes, at least four."""
    counted = 24 + 8 + 3 + area + zones
    return next(width for width in range(4, 12) if (counted + width) % 8 == 0)


def stuffed(plain):
    """COBS, a byte at a time; also after which bytes of the frame an extra clock goes by."""
    out, block, extra = bytearray(), bytearray(), []
    for index, byte in enumerate(plain):
        if len(block) == 254:
            out += b"\xff" + block
            block.clear()
            extra.append(index)
        if byte:
            block.append(byte)
        else:
            out += bytes([len(block) + 1]) + block
            block.clear()
    return bytes(out + bytes([len(block) + 1]) + block), extra


def random_trailer(rng, skin):
    _, area, zones = sizes(skin)
    widths = {"time": 24, "overflow": 1, "mismatch": 1, "fault": 1, "heard": 3, "cells": area, "zones": zones}
    return {name: rng.randrange(1 << width) for name, width in widths.items()}


def most_items(skin):
    return skin.zone_capacity if skin.report == "moments" else skin.rows


def random_items(rng, size, count, zeros):
    return [bytes(0 if rng.random() < zeros else rng.randrange(1, 256) for _ in range(size)) for _ in range(count)]


def run(bench, skin, frames, rng, gap=0.0):
    """Pack the frames; returns for each sent one (bytes, cycle of commit), the items' source, and the verdicts."""
    size = sizes(skin)[0]
    dut = Packer(skin, OFFSET_BITS)
    sim = bench(dut)
    end = 1 << 8 * size
    words = [word for f in frames for word in [*(int.from_bytes(item, "little") for item in f.items), end]]
    source = sim.source(dut.items, words, rng, gap=gap)
    owner = [index for index, frame in enumerate(frames) for _ in range(len(frame.items) + 1)]
    widths = {"sequence": 8, "overwritten": overwritten_width(*sizes(skin)[1:])}
    verdicts = [{name: rng.randrange(1 << width) for name, width in widths.items()} for _ in frames]

    def frame_now():
        """Number of the frame that is packed, and whether it is its trailer that is being written."""
        frame = owner[min(len(source.transfers), len(owner) - 1)] if not source.done else len(frames)
        in_trailer = sum(frame.send for frame in frames[:frame]) > len(memory.frames)
        return min(frame - in_trailer, len(frames) - 1), in_trailer

    for name in ("cells", "zones", "overflow", "mismatch"):
        sim.drive(dut.summary[name], lambda cycle, name=name: frames[frame_now()[0]].trailer[name])
    for name in ("time", "fault", "heard"):
        sim.drive(dut.tag[name], lambda cycle, name=name: frames[frame_now()[0]].trailer[name])
    for name, width in widths.items():  # noise until the end mark is decided upon

        def decided(cycle, name=name, width=width):
            frame, in_trailer = frame_now()
            return verdicts[frame][name] if in_trailer else rng.randrange(1 << width)

        sim.drive(dut.frames.verdict[name], decided)
    sim.drive(dut.frames.verdict.send, lambda cycle: int(frames[frame_now()[0]].send))
    memory = Memory(sim, dut)
    sent = sum(frame.send for frame in frames)
    sim.run(60 * len(words) * (size + 20), until=lambda: len(memory.follow().frames) == sent and source.done)
    assert memory.decided == [cycle for cycle, word in zip(source.transfers, words) if word == end]
    return memory.frames, source, verdicts


class Memory:
    """Memory that the packer writes."""

    def __init__(self, sim, dut):
        self._watched = [
            sim.watch(signal) for signal in (dut.frames.write.en, dut.frames.write.offset, dut.frames.write.data)
        ]
        self._commit, self._end, self._decide = (
            sim.watch(dut.frames.commit),
            sim.watch(dut.frames.end),
            sim.watch(dut.frames.decide),
        )
        self._bytes, self._seen = {}, 0
        self.frames, self.decided = [], []

    def follow(self):
        for cycle in range(self._seen, len(self._commit.values)):
            en, offset, data = (watch[cycle] for watch in self._watched)
            if en:
                self._bytes[offset] = data
            if self._decide[cycle]:
                self.decided.append(cycle)
            if self._commit[cycle]:
                self.frames.append((cycle, bytes(self._bytes[offset] for offset in range(self._end[cycle]))))
                self._bytes.clear()
        self._seen = len(self._commit.values)
        return self


def wanted(skin, frames, verdicts):
    return [stuffed(frame.plain(skin, verdict))[0] for frame, verdict in zip(frames, verdicts) if frame.send]


@pytest.mark.parametrize("name", SKINS)
@pytest.mark.parametrize("gap", [0.0, 0.7])
def test_frames_are_byte_exact_also_between_frames_that_are_not_sent(bench, rng, name, gap):
    skin = skin_of(name)
    size = sizes(skin)[0]
    frames = []
    for zeros in (0.0, 0.05, 0.5, 0.95, 1.0, 0.3):
        items = random_items(rng, size, rng.randrange(min(60, most_items(skin) + 1)), zeros)
        frames.append(Frame(items, random_trailer(rng, skin), send=rng.random() < 0.7))
    for count, send in ((0, False), (64, True), (64, False)):
        items = random_items(rng, size, min(count, most_items(skin)), 0.1)
        frames.append(Frame(items, random_trailer(rng, skin), send))
    frames.append(Frame([], random_trailer(rng, skin)))
    frames.append(Frame([bytes(size)], dict.fromkeys(frames[0].trailer, 0)))
    got, source, verdicts = run(bench, skin, frames, rng, gap)
    assert [written for _, written in got] == wanted(skin, frames, verdicts)
    if not gap:
        assert_clocks(skin, frames, verdicts, got, source)


def test_stuffing_of_the_oracle_is_the_published_one():
    assert stuffed(b"\x11\x22\x00\x33")[0] == b"\x03\x11\x22\x02\x33"


def until_first_zero(rng, size, length, count):
    """Items whose frame begins with ``length`` bytes that are not zero, and then a zero."""
    data = bytearray(rng.randrange(1, 256) for _ in range(size * count))
    data[length] = 0
    return [bytes(data[start : start + size]) for start in range(0, len(data), size)]


@pytest.mark.parametrize("length", [2, 252, 253, 254, 255, 256, 507, 508, 509, 510, 762, 763])
def test_blocks_around_254_bytes_and_their_clocks(bench, rng, length):
    skin = skin_of("zones of 5 bytes")
    frames = [Frame(until_first_zero(rng, 5, length, 180), random_trailer(rng, skin)) for _ in range(2)]
    got, source, verdicts = run(bench, skin, frames, rng)
    assert [written for _, written in got] == wanted(skin, frames, verdicts)
    assert_clocks(skin, frames, verdicts, got, source)


def test_a_frame_that_ends_with_a_full_block_has_no_empty_one_behind_it(bench, rng):
    skin = skin_of("zones of 5 bytes")
    # 5 * 49 + 9 bytes. The counters differ from frame to frame; in most of them they hold no zero.
    largest = {"time": 0xFFFFFF, "overflow": 1, "mismatch": 1, "fault": 1, "heard": 7, "cells": 1023, "zones": 255}
    frames = [Frame(random_items(rng, 5, 49, 0.0), largest) for _ in range(8)]
    got, source, verdicts = run(bench, skin, frames, rng)
    assert [written for _, written in got] == wanted(skin, frames, verdicts)
    full = [written for _, written in got if written[0] == 255]
    assert full
    assert {len(written) for written in full} == {255}
    assert_clocks(skin, frames, verdicts, got, source)


def assert_clocks(skin, frames, verdicts, got, source):
    """The packer's cycles by docs/timing.md, where each item waits already when it can be packed.

    An item leaves the stream with its last byte, which an extra clock of that byte itself does not hold up.
    """
    size = sizes(skin)[0]
    taken, waits, ready = [], [], 0
    for frame, verdict in zip(frames, verdicts, strict=True):
        plain = frame.plain(skin, verdict)
        extra = stuffed(plain)[1]
        for index in range(len(frame.items)):
            first, last = index * size, (index + 1) * size - 1
            taken.append(ready + size - 1 + sum(first <= at < last for at in extra))
            ready += size + sum(first <= at <= last for at in extra)
        taken.append(ready)
        if not frame.send:
            ready += 1
            continue
        trailer = len(plain) - size * len(frame.items)
        late = sum(at >= len(plain) - trailer for at in extra)
        ready += trailer + 2 + late
        waits.append(ready)
    assert source.transfers == taken
    assert [cycle + 1 for cycle, _ in got] == waits
