"""Backlog, packer and link in the simulator, and frames for them."""

import dataclasses

from amaranth.hdl import Module
from amaranth.lib import wiring
from amaranth.lib.wiring import In

from contactfpga_hdl.link.link import Link, offset_bits
from contactfpga_hdl.link.pack import Packer
from contactfpga_hdl.report.backlog import Backlog

ITEM_BYTES = {"moments": 2, "cells": 1}  # 5 + 5 + 5 bits, 4 bits
TRAILER_BYTES = 7  # 24 + 8 + 3 + 5 + 4 + 4 bits and the last byte
TAG = {"time": 24, "stuck": 3, "fault": 1, "heard": 3, "requested": 1}
SUMMARY = {"cells": 5, "zones": 4, "overflow": 1, "mismatch": 1, "changed": 1}


@dataclasses.dataclass
class Frame:
    items: list
    facts: dict
    not_before: list = dataclasses.field(default_factory=list)  # of the items and the end mark


class PackerAndLink(wiring.Component):
    """Backlog, packer and link as the top joins them."""

    def __init__(self, skin):
        self.skin = skin
        self.backlog, self.packer, self.link = Backlog(skin), Packer(skin, offset_bits(skin)), Link(skin)
        members = self.link.signature.members
        self.straight = [name for name in ("asked", "epoch", "number", "faults", "time") if name in members]
        outside = {name: members[name] for name in ("tag", "summary", "bytes", *self.straight)}
        if skin.self_test:
            outside["slots"] = members["slots"]
        super().__init__({"items": In(self.backlog.passed.signature.flip()), **outside})

    def elaborate(self, platform):
        m = Module()
        m.submodules += [self.backlog, self.packer, self.link]
        wiring.connect(m, wiring.flipped(self.items), self.backlog.passed)
        wiring.connect(m, self.backlog.waiting, self.packer.items)
        wiring.connect(m, self.packer.frames, self.link.frames)
        wiring.connect(m, self.link.bytes, wiring.flipped(self.bytes))
        for part in (self.packer, self.link):
            m.d.comb += [part.tag.eq(self.tag), part.summary.eq(self.summary)]
        m.d.comb += [getattr(self.link, name).eq(getattr(self, name)) for name in self.straight]
        if self.skin.self_test:
            wiring.connect(m, wiring.flipped(self.slots), self.link.slots)
        return m


def sealed(plain, before=b""):
    """COBS, check bytes and delimiter for a packet without long blocks; the check covers ``before`` as well."""
    stuffed = b"".join(bytes([len(block) + 1]) + block for block in plain.split(b"\0"))
    crc = crc16(before + stuffed)
    return stuffed + bytes([128 + crc % 128, 128 + crc // 128 % 128, 128 + crc // 128**2]) + b"\0"


def crc16(data):
    """CRC-16/MCRF4XX, bit by bit in the order of the line."""
    crc = 0xFFFF
    for byte in data:
        crc ^= byte
        for _ in range(8):
            crc = crc >> 1 ^ (0x8408 if crc & 1 else 0)
    return crc


def frame_of(skin, frame, sequence, overwritten):
    facts = frame.facts | {"sequence": sequence, "overwritten": overwritten}
    widths = {"time": 24, "sequence": 8, "heard": 3, "cells": 5, "zones": 4, "overwritten": 4}
    word = offset = 0
    for name, width in (widths | {"overflow": 1, "mismatch": 1, "fault": 1}).items():
        word |= facts[name] % (1 << width) << offset
        offset += width
    size = ITEM_BYTES[skin.report]
    items = b"".join(item.to_bytes(size, "little") for item in frame.items)
    word |= (5 if skin.report == "moments" else 6) << offset + 1
    return sealed(items + word.to_bytes(7, "little"), skin.fingerprint[:2])


def random_frames(rng, skin, count, spacing=1):
    """Frames at least as far apart as the Skin allows, their items somewhere in that time."""
    size = ITEM_BYTES[skin.report]
    most = skin.zone_capacity if skin.report == "moments" else 4
    frames, start = [], 1
    for index in range(count):
        items = [rng.randrange(1 << 8 * size - 1) for _ in range(rng.randrange(most + 1))]
        widths = TAG | SUMMARY
        facts = {name: rng.randrange(1 << width) for name, width in widths.items()} | {"time": index}
        facts["requested"] = int(rng.random() < 0.15)
        turns = facts["fault"] & facts["overflow"] & facts["mismatch"]  # now and then, as each change is sent
        facts["fault"] = frames[-1].facts["fault"] ^ turns if index > 1 else 0
        if index in (0, 1):  # the first one goes out all the same, the second one waits for the keep-alive
            facts |= {"changed": 0, "requested": 0}
        length = rng.choice((1, 1, spacing, 3 * spacing)) * (most * size + 32)
        end = start + length - 1
        times = sorted(rng.sample(range(start, end), len(items)))
        frames.append(Frame(items, facts, [*times, end]))
        start += length
    return frames


def decisions(skin, frames, keep_alive):
    """(cycle of the decision, whether sent) for each frame: none of it depends on the wire."""
    size, free, idle, fault, out = ITEM_BYTES[skin.report], 0, None, 0, []
    for frame in frames:
        for put in frame.not_before[:-1]:
            free = max(put + 2, free) + size
        taken = max(frame.not_before[-1] + 2, free)
        idle = None if idle is None else idle + 1
        facts = frame.facts
        sent = skin.send == "always" or bool(facts["changed"] or facts["requested"] or facts["fault"] != fault)
        fault = facts["fault"]
        sent = sent or idle is None or idle == keep_alive
        idle = 0 if sent else idle
        free = taken + (TRAILER_BYTES + 2 if sent else 1)
        out.append((taken, sent))
    return out


def packets_of(sink):
    """(cycle in which the first byte was offered, bytes) of every packet, and when its delimiter was taken. A second
    delimiter is passed over: it is offered a clock sooner than the one in front of a hello."""
    packets, ends, current, begun, before = [], [], b"", 0, -2
    for offered, (cycle, byte) in zip(sink.offered, sink.transfers):
        if not current and not byte and offered == before + 2:
            continue
        if not current:
            begun = offered
        else:
            assert offered - before <= 2, "bytes follow without a gap"
        current, before = current + bytes([byte]), cycle
        if not byte and len(current) > 1:
            packets.append((begun, current))
            ends.append(cycle)
            current = b""
    return packets, ends


def varying_stalls(rng, cycles):
    """Whether the wire is ready in each cycle: now fast, now hardly ever."""
    levels = []
    while len(levels) < cycles:
        rate = rng.choice((1.0, 0.5, 0.15, 0.05, 0.02))
        levels += [rng.random() < rate for _ in range(rng.choice((100, 400, 1200)))]
    return levels
