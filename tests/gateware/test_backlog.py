"""From rows to the packer at the shortest row time: nothing waits so long that it is lost."""

import math

import pytest
from amaranth.hdl import Module
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from contactfpga import Skin
from contactfpga.choices.labellers import LABELLERS
from contactfpga_hdl.link.link import offset_bits
from contactfpga_hdl.link.pack import Packer
from contactfpga_hdl.report.audit import Audit
from contactfpga_hdl.report.backlog import Backlog
from contactfpga_hdl.report.bitmap import Bitmap
from contactfpga_hdl.report.divide import Divider

SHEETS = {
    "1x64": {"rows": 1, "columns": 64, "connectivity": 4},
    "64x2": {"rows": 64, "columns": 2, "connectivity": 4},
    "9x9": {"rows": 9, "columns": 9, "connectivity": 8},
    "16x16, 8": {"rows": 16, "columns": 16, "connectivity": 8},
    "16x16, 4": {"rows": 16, "columns": 16, "connectivity": 4},
    "12x30, few zones": {"rows": 12, "columns": 30, "connectivity": 4, "zone_capacity": 20},
    "24x40, 8": {"rows": 24, "columns": 40, "connectivity": 8, "zone_capacity": 110},
    "24x40, 4": {"rows": 24, "columns": 40, "connectivity": 4, "zone_capacity": 110},
    "1x64, divided": {"rows": 1, "columns": 64, "report": "barycenter", "barycenter_bits": 0},
    "9x9, divided": {"rows": 9, "columns": 9, "report": "barycenter"},
    "16x16, divided": {"rows": 16, "columns": 16, "report": "barycenter", "barycenter_bits": 8},
    "12x30, divided, few zones": {
        "rows": 12,
        "columns": 30,
        "connectivity": 4,
        "report": "barycenter",
        "zone_capacity": 20,
    },
    "1x1, cells": {"rows": 1, "columns": 1, "report": "cells"},
    "1x7, cells": {"rows": 1, "columns": 7, "report": "cells"},
    "1x9, cells": {"rows": 1, "columns": 9, "report": "cells"},
    "2x3, cells": {"rows": 2, "columns": 3, "report": "cells"},
    "3x64, cells": {"rows": 3, "columns": 64, "report": "cells"},
}


def cases():
    """Every sheet with every labeller; bitmaps have none. `make test` takes a labeller for each, in turn."""
    for number, (name, fields) in enumerate(SHEETS.items()):
        labellers = list(LABELLERS) if fields.get("report") != "cells" else ["run"]
        for labeller in labellers:
            long = name in ("24x40, 8", "24x40, 4", "9x9, divided", "16x16, divided", "12x30, few zones")
            long |= labeller != labellers[number % len(labellers)]
            yield pytest.param(name, labeller, marks=[pytest.mark.campaign] * long)


class Chain(wiring.Component):
    """From the labeller to the packer, or from the bitmap to it, as the top joins them; every frame is sent."""

    def __init__(self, skin):
        self.backlog = Backlog(skin)
        self.divide = Divider(skin) if skin.report == "barycenter" else None
        self.packer = Packer(skin, offset_bits(skin))
        self.audit = Bitmap(skin) if skin.report == "cells" else Audit(skin)
        self.front = self.audit if skin.report == "cells" else LABELLERS[skin.labeller].load_gateware()(skin)
        super().__init__(
            {"rows": In(self.front.rows.signature.flip()), "ends": Out(1), "stalled": Out(1), "packed": Out(1)}
        )

    def elaborate(self, platform):
        m = Module()
        m.submodules += [self.audit, self.backlog, self.packer]
        wiring.connect(m, wiring.flipped(self.rows), self.front.rows)
        if self.front is not self.audit:
            m.submodules += self.front
            wiring.connect(m, self.front.records, self.audit.records)
            m.d.comb += [self.audit.taken.eq(self.rows.valid & self.rows.ready), self.audit.row.eq(self.rows.payload)]
        wiring.connect(m, self.audit.items, self.backlog.passed)
        items = self.backlog.waiting
        if self.divide:
            m.submodules += self.divide
            wiring.connect(m, self.backlog.waiting, self.divide.records)
            items = self.divide.items
        wiring.connect(m, items, self.packer.items)
        m.d.comb += [
            self.packer.summary.eq(self.audit.summary),
            self.packer.frames.verdict.send.eq(1),
            self.ends.eq(self.audit.items.valid & self.audit.items.ready & self.audit.items.payload.end),
            self.stalled.eq(~self.backlog.passed.ready),
            self.packed.eq(self.packer.frames.decide),
        ]
        return m


def shortest(fields):
    """The Skin with the shortest rows it allows, and their clocks: found by trying, not by its own formula."""
    for clocks in range(10, 400):
        try:
            skin = Skin(clock_hz=1_000_000, baud=250_000, settle_us=clocks - 1, release_us=1, **fields)
        except ValueError:
            continue
        return skin, clocks
    raise AssertionError("no Skin")


def patterns(rng, rows, columns, capacity):
    """Frames that close as many zones as they can, as late, as early or as close together as they can.

    Worst is a frame that closes just its capacity at its end, before one that does so at its start.
    """
    dots = sum(1 << x for x in range(0, columns, 2))
    other = ((1 << columns) - 1) ^ dots
    spread = [dots if y % 2 == 0 else 0 for y in range(rows)]
    checkers = [dots if y % 2 == 0 else other for y in range(rows)]
    frames = [spread, checkers]
    for pattern, rows_each in ((spread, 2), (checkers, 1)):
        some = min(rows, rows_each * math.ceil(capacity / math.ceil(columns / 2)))
        for count in (some, rows // 2):
            empty = [0] * (rows - count)
            frames += [empty + pattern[:count], pattern[:count] + empty]
    noise = [rng.randrange(1 << columns) for _ in range(rows)]
    return [*frames, [dots] * rows, noise, checkers, checkers]


@pytest.mark.parametrize(("name", "labeller"), list(cases()))
def test_no_item_is_lost_and_no_summary_is_late_in_the_worst_frames(bench, rng, name, labeller):
    skin, clocks = shortest({**SHEETS[name], "labeller": labeller})
    frames = patterns(rng, skin.rows, skin.columns, skin.zone_capacity)
    frames *= 1 + 100 // (skin.rows * skin.columns)  # time for what is late to add up
    dut = Chain(skin)
    sim = bench(dut)
    words = [word | (y == skin.rows - 1) << skin.columns for frame in frames for y, word in enumerate(frame)]
    source = sim.source(dut.rows, words, not_before=[clocks * (index + 1) for index in range(len(words))])
    stalled, packed = sim.watch(dut.stalled), sim.watch(dut.packed)
    ends = sim.watch(dut.ends)
    mismatch = sim.watch(dut.audit.summary.mismatch)
    overflow, zones = sim.watch(dut.audit.summary.overflow), sim.watch(dut.audit.summary.zones)
    sim.run(clocks * (len(words) + skin.rows + 4))
    assert source.transfers == [clocks * (index + 1) for index in range(len(words))], "the labeller is ready in time"
    assert not any(stalled.values)
    assert not any(mismatch.values)
    ended = [cycle for cycle, value in enumerate(ends.values) if value]
    decided = [cycle for cycle, value in enumerate(packed.values) if value]
    assert len(ended) == len(decided) == len(frames)
    for end, decide, following in zip(ended, decided, [*ended[1:], len(ends.values)]):
        assert end + 2 <= decide <= following, "packed while its summary holds"
    for end in ended:
        assert overflow[end + 1] == (zones[end + 1] > skin.zone_capacity)
