"""The stages put together: from a Skin and the cells over time to the events at every boundary."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from contactfpga_sim.golden import divide, label, request, scan, uart
from contactfpga_sim.golden.facts import Facts, facts
from contactfpga_sim.golden.frame import Items, Packer, Queue, join
from contactfpga_sim.golden.hello import State
from contactfpga_sim.golden.link import Link
from contactfpga_sim.golden.trace import Timeline, Trace

if TYPE_CHECKING:
    from contactfpga.skin import Skin


def predict(skin: Skin, timeline: Timeline, cycles: int) -> Trace:
    """What a board built from ``skin`` does in cycles 0 to ``cycles`` - 1, by the rules of docs/timing.md."""
    known = facts(skin)
    heard = request.heard(timeline.received, known.bit_clocks)
    scanned, counted, contact = known.scan.scanned(known, timeline, heard.requests, cycles)
    trace = Trace(cycles)
    link = Link(known, State(known, scanned, heard))
    for cycle in (0, *(one.cycle + 1 for one in heard.requests if one.hello)):
        link.want_hello(cycle)
    packer = Packer(known, link, divide.Divider(known, trace) if known.divided else Queue())
    handed = Labeller(known, trace)
    for one, cells in zip(scanned, counted, strict=True):
        packer.take(handed.take(one, cells))
    link.advance(cycles)
    trace.bytes = link.bytes
    trace.line = uart.line(link.bytes, known.bit_clocks)
    trace.contact = contact
    return trace.until(cycles)


def driven(skin: Skin, timeline: Timeline, cycles: int) -> list[tuple[int, int]]:
    """(cycle, rows) of every change of the rows that are driven in cycles 0 to ``cycles`` - 1; bit r is row r."""
    known = facts(skin)
    return [change for change in known.scan.driven(known, timeline, cycles) if change[0] < cycles]


def beginnings(skin: Skin, timeline: Timeline, cycles: int) -> list[int]:
    """Cycles in which the first row time of a frame begins, up to ``cycles`` and one beyond."""
    known = facts(skin)
    return known.scan.beginnings(known, timeline, cycles)


class Labeller:
    """Hands rows over and emits records, noting both in a trace."""

    def __init__(self, facts: Facts, trace: Trace):
        self._facts = facts
        self._trace = trace
        self._free = 0
        self._handed = -1

    def take(self, one: scan.Scan, cells: np.ndarray) -> Items:
        """Work one frame; ``cells`` (R, C) are the samples of ``one``, debounced."""
        facts = self._facts
        late = facts.columns + 3 if facts.debounced else 0  # a row driven alone; the others pass
        words = [int(np.sum(1 << np.nonzero(row)[0].astype(object))) for row in cells]
        work = label.labelling(cells, facts.skin.connectivity, facts.skin.labeller)
        handed = []
        for row, offered in enumerate(one.offered):
            last = row == facts.rows - 1
            cycle = max(max(offered, self._handed + 1) + late * (row in one.alone), self._free)
            self._handed = cycle
            handed.append(cycle)
            self._trace.rows.append((cycle, words[row], last))
            if facts.zones:
                self._free = cycle + work.busy[row]
        if facts.zones:
            records = [(handed[zone.row] + zone.clock, self._record(zone)) for zone in work.departures]
            end = handed[-1] + work.end
        else:
            records = list(zip(handed, words, strict=True))
            end = handed[-1] + 3
        self._trace.records += [(cycle, data, False) for cycle, data in records] + [(end, 0, True)]
        return Items(one, cells, records, end)

    def _record(self, zone: label.Departure) -> int:
        facts = self._facts
        fields = (zone.area, facts.area_bits), (zone.sum_x, facts.sum_x_bits), (zone.sum_y, facts.sum_y_bits)
        return join(fields)[0]
