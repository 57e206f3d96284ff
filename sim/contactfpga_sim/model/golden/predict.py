"""All stages: from a Skin and cells over time to the events at every boundary."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import TYPE_CHECKING

import numpy as np

from contactfpga.choices import scans
from contactfpga_sim.model.golden import label, request, scan, uart, units
from contactfpga_sim.model.golden.facts import Facts, facts
from contactfpga_sim.model.golden.faults import FaultHistory
from contactfpga_sim.model.golden.frame import Divider, Items, Packer, Queue, join
from contactfpga_sim.model.golden.hello import State
from contactfpga_sim.model.golden.link import Link, SharedLine
from contactfpga_sim.model.golden.trace import Timeline, Trace
from contactfpga_sim.model.golden.zones import Departure

if TYPE_CHECKING:
    from contactfpga.skin import Skin
import bisect
from collections.abc import Iterable


def predict(skin: Skin, timeline: Timeline, cycles: int) -> Trace:
    """Trace of a board of ``skin`` in cycles 0 to ``cycles`` - 1, by docs/timing.md."""
    trace, link, _ = _play(facts(skin), timeline, cycles)
    trace.bytes = link.bytes
    trace.line = uart.line(link.bytes, facts(skin).bit_clocks)
    return trace.until(cycles)


def predict_several(skins: Sequence[Skin], timelines: Sequence[Timeline], cycles: int) -> list[Trace]:
    """Traces of sheets on one FPGA, which share ``line`` and ``contact``.

    Received bytes are the same in all timelines. Each sheet has a thread, which waits for the others at the shared
    line.
    """
    known = [Facts(skin, (number, len(skins))) for number, skin in enumerate(skins)]
    line = SharedLine(len(skins))
    with ThreadPoolExecutor(len(skins)) as pool:
        plays = [pool.submit(_play_one, line, *one, cycles) for one in zip(known, timelines, strict=True)]
        played = [play.result() for play in plays]
    sent = uart.line(sorted(byte for _, link in played for byte in link.bytes), known[0].bit_clocks)
    contact: list[tuple[int, int]] = []
    for trace, link in played:
        trace.bytes, trace.line = link.bytes, sent
        contact = _either(contact, trace.contact)
    contact = _later(contact)
    for trace, _ in played:
        trace.contact = contact
    return [trace.until(cycles) for trace, _ in played]


def _play_one(line: SharedLine, known: Facts, timeline: Timeline, cycles: int) -> tuple[Trace, Link]:
    assert known.place is not None
    try:
        return _play(known, timeline, cycles, line)[:2]
    finally:
        line.leave(known.place[0])


def driven(skin: Skin, timeline: Timeline, cycles: int) -> list[tuple[int, int]]:
    """(cycle, rows) of every change of the driven rows; bit r is row r."""
    return [change for change in _play(facts(skin), timeline, cycles)[2].driven if change[0] < cycles]


def beginnings(skin: Skin, timeline: Timeline, cycles: int) -> list[int]:
    """First cycles of frames up to ``cycles``, and one beyond."""
    return _play(facts(skin), timeline, cycles)[2].beginnings


def _play(
    known: Facts, timeline: Timeline, cycles: int, line: SharedLine | None = None
) -> tuple[Trace, Link, scan.ScanOutput]:
    skin = known.skin
    heard = request.heard(timeline.received, known.bit_clocks, bool(known.commands), known.closing)
    trace = Trace(cycles)
    frames: list[scan.Scan] = []
    faults = FaultHistory()
    pressed = units.play(known, timeline, heard.requests, cycles)
    link = Link(known, State(known, frames, heard), faults, pressed.packets, line)
    half_second = 2**19 * known.clocks_per_us
    timed = range(half_second + 1, cycles, half_second) if known.scan.waits else ()
    for cycle in (0, *timed, *(one.cycle + 1 for one in heard.requests if one.hello)):
        link.want_hello(cycle)
    packer = Packer(known, link, Divider(known, trace) if known.divided else Queue())
    stages = Pipeline(known, trace, packer, frames, faults, link)
    rule: scan.ScanRule = scans.find(skin.scan).load_golden()
    scanned = rule.scan(scan.Play(known, timeline, heard.requests, cycles, stages))
    link.finish(cycles)
    faulty = _fault(frames, stages.fault_changes, scanned.stuck)
    touched = _either(scanned.contact, pressed.over)
    unwatched = [(0, 1), *((cycle, 1 - level) for cycle, level in pressed.armed)] if skin.units else []
    if skin.fail_safe:
        touched = _either(touched, _either(faulty, unwatched))
    trace.contact = _later(touched) if skin.fail_safe or skin.units else touched
    trace.alive = _alive(known, sorted(stages.well), faulty, cycles) if skin.alive else []
    return trace, link, scanned


class Pipeline:
    """The stages after the scan, which record all events in a trace."""

    def __init__(
        self, facts: Facts, trace: Trace, packer: Packer, scanned: list[scan.Scan], reported: FaultHistory, link: Link
    ):
        self._facts = facts
        self._reported = reported
        self._link = link
        self._trace = trace
        self._packer = packer
        self._scanned = scanned
        self.fault_changes: scan.Changes = []
        """(cycle, faults) of every change of reported faulty lines."""
        self.well: list[int] = []
        """Cycles in which a frame was packed or an untouched sheet checked."""
        self._free = 0
        self._handed = -1
        self._late = facts.columns + 3 if facts.debounced else 0  # a driven row; the others pass

    def tell(self, cycle: int, faults: int) -> None:
        if faults != (self.fault_changes[-1][1] if self.fault_changes else 0):
            self.fault_changes.append((cycle, faults))
            self._reported.change(cycle, faults)

    def watch(self, cycle: int) -> None:
        self.well.append(cycle)

    def slot(self, cycle: int, number: int, rows: int, columns: int) -> None:
        self._link.offer_slot(cycle, number, rows, columns)

    def slot_over(self, cycle: int) -> int | None:
        return self._link.slot_over(cycle)

    def frame(self, one: scan.Scan, cells: np.ndarray) -> None:
        work = self.labelling(cells)
        handed = []
        for row, offered in enumerate(one.offered):
            last = row == self._facts.rows - 1
            handed.append(self.hand_over(self.taken(offered), cells[row], True, last))
            if self._facts.zones:
                self.keep_busy(handed[-1] + work.busy[row])
        self.end(one, cells, cells, range(self._facts.rows), handed, work)

    def labelling(self, cells: np.ndarray) -> label.Labelling:
        """The labeller's work on a frame of rows."""
        skin = self._facts.skin
        return label.labelling(cells, skin.connectivity, skin.labeller, skin.closed and self._facts.zones)

    @property
    def due(self) -> int:
        return self._packer.due

    def rows(self) -> RowPipeline:
        return RowPipeline(self._facts, self)

    def taken(self, offered: int) -> int:
        """Cycle in which a row offered from a cycle on is taken, at most one per clock."""
        return max(offered, self._handed + 1)

    def hand_over(self, taken: int, cells: np.ndarray, alone: bool, last: bool, earliest: int = 0) -> int:
        """Hand over a taken row, through the debounce if it was driven (``alone``); returns the cycle."""
        cycle = max(taken + self._late * alone, self._free, earliest)
        self._handed = cycle
        self._trace.rows.append((cycle, _word(cells, self._facts.level_bits), last))
        return cycle

    def keep_busy(self, until: int) -> None:
        """The labeller accepts no row before this cycle."""
        self._free = until

    def end(
        self,
        one: scan.Scan,
        cells: np.ndarray,
        taken: np.ndarray,
        places: Sequence[int],
        handed: list[int],
        work: label.Labelling,
    ) -> int:
        """Emit the records of the ``taken`` rows at these ``places``, and pack the frame."""
        facts = self._facts
        if facts.zones:
            records = [
                (handed[zone.row] + zone.clock, self._record(zone, _sum_y(zone, taken, places), places))
                for zone in work.departures
            ]
            end = handed[-1] + work.end
        else:
            records = [(cycle, _word(row, facts.level_bits)) for cycle, row in zip(handed, taken, strict=True)]
            end = handed[-1] + 3
        self._trace.records += [(cycle, data, False) for cycle, data in records] + [(end, 0, True)]
        self._scanned.append(one)
        free = self._packer.take(Items(one, cells, records, end))
        self.well.append(free - 1)
        return free

    def _record(self, zone: Departure, sum_y: int, places: Sequence[int]) -> int:
        facts = self._facts
        fields = [(zone.area, facts.area_bits), (zone.sum_x, facts.sum_x_bits), (sum_y, facts.sum_y_bits)]
        if facts.skin.closed:
            fields.append((zone.turned, facts.area_bits))
        left, right, top, bottom = zone.extent
        fields += zip((left, right, places[top], places[bottom]), facts.extent_bits)
        return join(tuple(fields))[0]


class RowPipeline:
    """A frame row by row. Empty rows separate rows that are not neighbors."""

    def __init__(self, facts: Facts, stages: Pipeline):
        self._facts = facts
        self._stages = stages
        self._cells: list[np.ndarray] = []
        self._places: list[int] = []
        self._handed: list[int] = []

    def take(self, place: int, cells: np.ndarray, offered: int, alone: bool, last: bool) -> int:
        stages = self._stages
        taken = stages.taken(offered)
        cycle = stages.hand_over(taken, cells, alone, last, self._counted() if cells.any() else 0)
        self._cells.append(cells)
        self._places.append(place)
        self._handed.append(cycle)
        if self._facts.zones:
            stages.keep_busy(cycle + self._work([*self._cells, np.zeros_like(cells)]).busy[len(self._cells) - 1])
        return taken if alone and self._facts.debounced else cycle

    def end(self, one: scan.Scan, cells: np.ndarray) -> int:
        rows = self._cells
        return self._stages.end(one, cells, np.array(rows), self._places, self._handed, self._work(rows))

    def _work(self, rows: list[np.ndarray]) -> label.Labelling:
        return self._stages.labelling(np.array(rows))

    def _counted(self) -> int:
        """The cycle from which a row with a pressed cell can be counted: after the previous row's groups of columns,
        counted in clocks without a zone that passed in the clock before."""
        pressed = [index for index, row in enumerate(self._cells) if row.any()]
        if not pressed:
            return 0
        cycle = self._handed[pressed[-1]] + 1
        passing: set[int] = set()
        if self._facts.zones:
            work = self._work([*self._cells, np.zeros_like(self._cells[0])])
            handed = self._handed
            passing = {handed[zone.row] + zone.clock + 1 for zone in work.departures if zone.row < len(handed)}
        left = 1 + self._facts.column_groups
        while left:
            left -= cycle not in passing
            cycle += 1
        return cycle


def _sum_y(zone: Departure, taken: np.ndarray, places: Sequence[int]) -> int:
    pressed = taken.sum(axis=1)
    if zone.area == pressed.sum():
        return int(pressed @ np.array(places))
    return zone.sum_y + (places[zone.row] - zone.row) * zone.area


def _word(cells: np.ndarray, width: int) -> int:
    return sum(int(cell) << width * column for column, cell in enumerate(cells))


TICK_US = 1000


def _fault(scanned: Iterable[scan.Scan], faults: scan.Changes, stuck: scan.Changes) -> scan.Changes:
    sources = [(one.reported, int(one.fault)) for one in scanned], [(at, int(word > 0)) for at, word in faults], stuck
    marks = [(cycle, source, level) for source, changes in enumerate(sources) for cycle, level in changes]
    known, levels = [0, 0, 0], []
    for cycle, source, level in sorted(marks):
        known[source] = level
        levels.append((cycle, max(known)))
    return _changes(levels)


def _either(one: scan.Changes, other: scan.Changes) -> scan.Changes:
    cycles = sorted({cycle for cycle, _ in (*one, *other)})
    return _changes((cycle, _level(one, cycle) | _level(other, cycle)) for cycle in cycles)


def _later(level: scan.Changes) -> scan.Changes:
    return [(cycle + 1, high) for cycle, high in level]


def _alive(facts: Facts, well: Sequence[int], faulty: scan.Changes, cycles: int) -> scan.Changes:
    period, level, changes = TICK_US * facts.clocks_per_us, 0, []
    for tick in range(period - 1, cycles, period):
        last = bisect.bisect_left(well, tick) - 1  # the last time before the tick, as a later one is after more faults
        seen = well[last] if last >= 0 else -1
        if seen >= max(0, tick - period) and not _level(faulty, seen) and not _rises(faulty, seen, tick - 1):
            level ^= 1
            changes.append((tick + 1, level))
    return changes


def _level(changes: scan.Changes, cycle: int) -> int:
    index = bisect.bisect_right(changes, cycle, key=lambda change: change[0]) - 1
    return changes[index][1] if index >= 0 else 0


def _rises(changes: scan.Changes, begin: int, end: int) -> bool:
    return any(begin < cycle <= end and level for cycle, level in changes)


def _changes(levels: Iterable[tuple[int, int]]) -> scan.Changes:
    """The last change of each cycle counts; the level is low at first."""
    found: scan.Changes = []
    for cycle, level in dict(levels).items():
        if level != (found[-1][1] if found else 0):
            found.append((cycle, level))
    return found
