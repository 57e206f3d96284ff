"""The stream of records of `contactfpga ip`, clock by clock: the exported file, and the golden model, under stalls."""

import dataclasses
import itertools
import random
import subprocess
import sys

import numpy as np
import pytest
from sample import sample

from contactfpga.driver.conversation import Conversation, frames_in
from contactfpga.skin import Skin
from contactfpga.wire.hello import Hello
from contactfpga_hdl.core import Core
from contactfpga_sim.model import golden
from contactfpga_sim.model.golden.frame import Packer
from contactfpga_sim.model.golden.trace import Timeline
from contactfpga_sim.verify import ip
from contactfpga_sim.verify.cosim import bench_cocotb

SMALL = Skin(rows=4, columns=5, clock_hz=3_000_000, baud=750_000, settle_us=9.0)
SKINS = {
    "moments": SMALL,
    "one zone at most": SMALL.replace(zone_capacity=1),
    "on change": SMALL.replace(send="on_change", keep_alive_ms=0.4),
    "barycenters": SMALL.replace(report="barycenter", labeller="serial", settle_us=14.0),
    "cells": SMALL.replace(report="cells", diodes="row2col"),
    "reversal": SMALL.replace(scan="reversal", precharge_us=0.5, send="on_change", keep_alive_ms=3.5),
}
FRAMES = 24


@dataclasses.dataclass
class PackedItem:
    """What the golden model's packer takes in a clock: an item, or with it None the end mark of a frame. Without a
    closing word neither: a restart, which drops the frame that is being filled."""

    item: int | None
    closing: dict[str, int] | None = None
    sent: bool = False


class WatchedQueue:
    """A queue in front of the golden model's packer, whose items are noted."""

    def __init__(self, queue, noted):
        self._queue, self._noted = queue, noted

    def __getattr__(self, name):
        return getattr(self._queue, name)

    def take(self, cycle, item):
        self._queue.take(cycle, item)
        self._noted[cycle] = PackedItem(item)


def packed(skin, timeline, clocks, monkeypatch):
    """Items that the packer takes, by clock."""
    noted = {}

    class Noting(Packer):
        def __init__(self, facts, link, queue):
            super().__init__(facts, link, WatchedQueue(queue, noted))

        def _is_sent(self, items, taken):
            zones = len(items.records) if skin.report != "cells" else 0
            closing = {
                "time": items.scan.time_us % 2**24,
                "cells": int(items.cells.sum()),
                "zones": zones,
                "overflow": zones > skin.derived.max_items,
                "fault": items.scan.fault,
                "motion": items.scan.motion,
            }
            noted[taken] = PackedItem(None, closing, super()._is_sent(items, taken))
            return noted[taken].sent

    monkeypatch.setattr(sys.modules["contactfpga_sim.model.golden.predict"], "Packer", Noting)
    golden.predict(skin, timeline, clocks)
    return noted


def word(fields, values):
    """Values in fields of these bits, from bit 0 on."""
    whole = place = 0
    for name, bits in fields.items():
        whole |= int(values.get(name, 0)) << place
        place += bits
    return whole


def offered(skin, noted, takes):
    """Word on offer in each clock as (data, last), or None: docs/ip.md in Python."""
    filling, reading, waiting, out = [], [], None, None
    number, owed, seen = 0, False, []
    for clock, taken in enumerate(takes):
        seen.append(out)
        begins = waiting is not None and not reading
        if out is None or taken:
            out = reading.pop(0) if reading else None
        if begins:
            reading, waiting = waiting, None
        if event := noted.get(clock):
            if event.item is not None or event.closing:
                owed |= waiting is not None
                waiting = None
            if event.item is not None:
                filling.append((event.item, False))
                continue
            if event.closing and (event.sent or owed):
                closing = word(ip.closing_fields(skin), event.closing | {"number": number})
                waiting, number, owed = [*filling, (closing, True)], number + 1, False
            filling = []
    return seen


@dataclasses.dataclass
class CoreRun:
    """A core that was simulated in Amaranth's simulator."""

    ports: list[ip.Port]
    words: list[int]
    takes: list[bool]

    def __post_init__(self):
        inside = self.ports[1:]
        self._places, place = {}, 0
        for port in [*(port for port in inside if port.takes), *(port for port in inside if not port.takes)]:
            self._places[port.name] = place, (1 << port.bits) - 1
            place += port.bits

    def levels(self, name):
        """Levels of a port in each clock."""
        place, mask = self._places[name]
        return [one >> place & mask for one in self.words]

    def records(self):
        """Record words in each clock, as :func:`offered`."""
        some = (self.levels(f"m_axis_records_t{name}") for name in ("valid", "data", "last"))
        return [(data, bool(last)) if valid else None for valid, data, last in zip(*some, strict=True)]


def frames(rng, skin):
    """Random cells that change about every scan, as (clock, cells)."""
    scan = skin.derived.frame_clocks
    at = ip.RESET + 10
    for _ in range(FRAMES):
        yield at, rng.random((skin.rows, skin.columns)) < rng.choice([0.0, 0.1, 0.3, 0.6])
        at += int(rng.integers(scan // 2, 2 * scan))


def play(skin, seed, takes, received=()):
    """The core under random frames; ``takes(clock)`` is whether its records are taken, ``received`` are (clock, bytes)
    at its pin ``rx``. Also its timeline from when reset ends."""
    given = list(frames(np.random.default_rng(seed), skin))
    core = Core(skin)
    ports = ip.ports(skin, core)
    clocks = given[-1][0] + 2 * skin.derived.frame_clocks
    taken = [takes(clock) for clock in range(clocks)]
    timeline = Timeline([(clock, cells, None) for clock, cells in given], list(received))
    words = ip.simulated(skin, core, ports, timeline, clocks, lambda clock: (clock % 3 == 0, taken[clock]))
    late = Timeline([(clock - ip.RESET, cells, None) for clock, cells in given])
    return CoreRun(ports, words, taken), late


def stalling(seed):
    """A reader that takes a word always, seldom or not for a while, in turn."""
    rng = random.Random(seed)
    phase = {"until": 0, "share": 1.0}

    def takes(clock):
        if clock >= phase["until"]:
            phase.update(until=clock + rng.randrange(20, 500), share=rng.choice([1.0, 0.7, 0.2, 0.02, 0.0]))
        return rng.random() < phase["share"]

    return takes


def numbers(skin, words):
    """Numbers of the frames that these words close."""
    fields = ip.closing_fields(skin)
    low = sum(bits for name, bits in fields.items() if name == "time")
    return [data >> low & 0xFFFF for data, last in words if last]


NAMES = [name if name in ("moments", "on change") else pytest.param(name, marks=pytest.mark.slow) for name in SKINS]


@pytest.mark.parametrize("name", NAMES)
def test_every_clock_of_a_reader_that_stalls_is_as_the_golden_model_says(monkeypatch, name):
    skin = SKINS[name]
    played, timeline = play(skin, 1, stalling(1))
    noted = packed(skin, timeline, len(played.words), monkeypatch)
    right = [None] * ip.RESET + offered(skin, noted, played.takes[ip.RESET :])
    got = played.records()
    wrong = [clock for clock, (one, other) in enumerate(zip(got, right, strict=True)) if one != other]
    assert not wrong, (wrong[0], got[wrong[0]], right[wrong[0]])
    taken = [one for one, now in zip(got, played.takes, strict=True) if one and now]
    found = numbers(skin, taken)
    assert len(found) > 4
    assert any(late - early > 1 for early, late in itertools.pairwise(found))  # a frame was replaced


@pytest.mark.slow
@pytest.mark.skipif(not bench_cocotb.available("icarus"), reason="no Icarus Verilog")
@pytest.mark.parametrize("name", sample(SKINS, quick=["moments", "cells", "reversal"]))
def test_the_exported_file_does_the_same_in_every_clock(tmp_path, name):
    skin = SKINS[name]
    played, _ = play(skin, 2, stalling(2))
    files = {
        "core.v": ip.verilog(skin),
        "sva.sv": ip.assertions(skin, played.ports, ip.NAME),
        "tb.v": ip.testbench(played.ports, len(played.words), ip.NAME),
    }
    for file, text in files.items():
        (tmp_path / file).write_text(text)
    (tmp_path / "vectors.hex").write_text("".join(f"{one:x}\n" for one in played.words))
    subprocess.run(["iverilog", "-g2012", "-o", "tb", *files], cwd=tmp_path, check=True)
    said = subprocess.run(["vvp", "tb"], cwd=tmp_path, capture_output=True, text=True, timeout=300).stdout
    assert said.splitlines() == [f"PASS: {len(played.words)} clocks"]


@pytest.mark.parametrize("name", ["moments", "on change"])
def test_a_reader_that_never_takes_keeps_its_frame_and_holds_up_nothing(name):
    """A reader that takes no words until the end gets the frame that it was offered first, then the newest one, whose
    number says how many were replaced."""
    skin = SKINS[name]
    begins = FRAMES * skin.derived.frame_clocks // 2
    waited, _ = play(skin, 3, lambda clock: clock >= begins)
    eager, _ = play(skin, 3, lambda clock: True)
    for port in ("m_axis_tdata", "m_axis_tvalid", "rows", "contact"):
        assert waited.levels(port) == eager.levels(port)
    first = next(one for one in waited.records() if one)
    assert {one for one in waited.records()[:begins] if one} == {first}
    assert numbers(skin, [one for one in eager.records() if one])[:3] == [0, 1, 2]
    found = numbers(skin, [one for one in waited.records()[begins:] if one])
    assert found[0] == 0
    assert found[1] > 3
    assert found[1:] == list(range(found[1], found[1] + len(found) - 1))


def test_both_streams_tell_of_the_same_zones_and_a_request_is_answered():
    skin = SKINS["moments"]
    played, _ = play(skin, 4, lambda clock: True, golden.requests([600], skin.derived.bit_clocks))
    some = (played.levels(f"m_axis_t{name}") for name in ("valid", "ready", "data"))
    events = Conversation("a core").receive(bytes(data for valid, ready, data in zip(*some) if valid & ready), 0.0)
    assert [event.heard > 0 for event in events if isinstance(event, Hello)] == [False, True]
    sent = [zones.frame for zones in frames_in(events)]
    frames, records = {}, []
    for data, last in filter(None, played.records()):
        if last:
            frames[data & 0xFFFFFF], records = records, []
        else:
            records.append([data & 31, data >> 5 & 63, data >> 11 & 31])
    assert len(sent) > 10
    assert sum(len(frame.moments) for frame in sent) > 10
    for frame in sent:
        assert frames[frame.time_us] == frame.moments.tolist()
