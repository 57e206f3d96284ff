"""The raster scan."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable, Sequence

import numpy as np

from contactfpga_sim.model.golden import guard
from contactfpga_sim.model.golden.debounce import debounced
from contactfpga_sim.model.golden.facts import Facts
from contactfpga_sim.model.golden.guard import FaultyLines, closed, stuck
from contactfpga_sim.model.golden.request import Request
from contactfpga_sim.model.golden.scan import Changes, Play, Scan, ScanOutput, ScanRule, early_clocks, last_number
from contactfpga_sim.model.golden.trace import Timeline


class Raster(ScanRule):
    """Row after row, each for the same time."""

    waits = False

    def scan(self, play: Play) -> ScanOutput:
        facts, frames = play.facts, play.cycles // play.facts.scan_clocks + 1
        scanned = scans(facts, play.timeline, play.requests, frames)
        counted = debounced(
            np.array([one.cells for one in scanned]), facts.skin.debounce, facts.press_scans, facts.release_scans
        )
        reports = checks(facts, play.timeline, frames, play.requests)
        for change in (change for frame in reports for change in frame):
            play.stages.tell(*change)
        for one, cells, changes in zip(scanned, counted, reports, strict=True):
            play.stages.frame(dataclasses.replace(one, faults=changes[-1][1] if changes else 0), cells)
        driven = []
        for slot in range(frames * facts.row_lines):
            start = facts.first_slot + slot * facts.row_clocks
            driven += [(start, 1 << _line(facts, slot)), (start + facts.settle, 0)]
        beginnings = [facts.first_slot + number * facts.scan_clocks for number in range(frames + 1)]
        return ScanOutput(contact(facts, scanned), driven, beginnings)


RASTER = Raster()


def strobe(facts: Facts, slot: int) -> int:
    """Cycle in which a slot's sample has passed shift registers and synchronizers."""
    return sampled(facts, slot) + 2 + facts.column_shift


def sampled(facts: Facts, slot: int) -> int:
    """Cycle whose column levels a slot samples."""
    return facts.first_slot + slot * facts.row_clocks + facts.settle - 1


def _asked_before(facts: Facts, slot: int) -> int:
    if facts.samples_early:
        return facts.first_slot + (slot - (facts.skin.ruler > 0)) * facts.row_clocks  # the ruler is in the guard row
    return sampled(facts, slot) - facts.load if facts.load else strobe(facts, slot)


def scans(facts: Facts, timeline: Timeline, requests: Sequence[Request], count: int) -> list[Scan]:
    """The first ``count`` scans; requests are in order of reception."""
    result = []
    for index, (early_by, _) in enumerate(_instants(facts, timeline, requests, count)):
        slots = row_slots(facts, index)
        begin = strobe(facts, slots[0])
        late = _asked_before(facts, slots[0])
        early = _asked_before(facts, slots[0] - facts.row_lines) if index else 0
        result.append(
            Scan(
                cells=_cells(facts, timeline, slots, early_by),
                offered=[strobe(facts, slot) + 1 for slot in slots],
                stuck=int(np.sum((_stuck(facts, timeline, index)[: facts.columns]) & ~facts.mask.all(axis=0))),
                time_us=(begin - facts.column_shift) // facts.clocks_per_us,
                requested=any(early <= request.cycle < late for request in requests),
                heard=last_number(requests, late) % 8,
                reported=strobe(facts, slots[-1]) + 2,
            )
        )
    return result


def _cells(facts: Facts, timeline: Timeline, slots: Iterable[int], early_by: Sequence[int]) -> np.ndarray:
    read = [[_read(facts, timeline, slot, ahead)[: facts.columns] for slot in slots] for ahead in early_by]
    return (np.array(read) & ~facts.mask).sum(axis=0, dtype=bool if facts.skin.levels == 1 else int)


def _instants(
    facts: Facts, timeline: Timeline, requests: Sequence[Request], count: int
) -> list[tuple[tuple[int, ...], bool]]:
    """By frame the clocks by which the sample of each level precedes the settle time's end, and whether rows are
    checked."""
    slots = [row_slots(facts, frame)[0] for frame in range(count)]
    if not facts.skin.ruler:
        early = [early_clocks(facts, requests, _asked_before(facts, slot)) for slot in slots]
        return [((clocks,), not clocks) for clocks in early]
    lines, found = FaultyLines(facts), []
    for frame, slot in enumerate(slots):
        start = _asked_before(facts, slot)
        values = [one.command[1] for one in requests if one.cycle < start and one.command and one.command[0] == 2]
        asked = [_sixteenths(facts, values, level) for level in range(facts.skin.levels)]
        ignored = lines.open_columns | facts.mask.all(axis=0)
        fallen = next(
            (clocks for clocks in range(1, facts.settle + 1) if _fell(facts, timeline, start + clocks - 1, ignored)), 0
        )
        instants = [max(facts.first_sample, fallen * each // 16) if fallen else facts.settle for each in asked]
        found.append((tuple(max(0, facts.settle - each) for each in instants), not fallen or asked[0] >= 24))
        lines.check("columns", ~_read(facts, timeline, slot - 1)[: facts.columns], _renews(facts, frame))
    return found


def _sixteenths(facts: Facts, values: Sequence[int], level: int) -> int:
    """Sixteenths of the ruler's time for a level, after commands with these values: with levels each names its own."""
    if facts.skin.levels > 1:
        values = [value % 256 for value in values if value // 256 == level]
    usual = (facts.skin.ruler, *facts.skin.harder)[level]
    return values[-1] if values and 1 <= values[-1] <= 255 else usual


def _fell(facts: Facts, timeline: Timeline, cycle: int, ignored: np.ndarray) -> bool:
    """Whether all columns that are not ``ignored``, and one at least, read pressed in the guard row's slot."""
    low = (closed(facts, timeline, cycle)[-1] | stuck(facts, timeline, cycle))[: facts.columns]
    return bool((low | ignored).all() and (low & ~ignored).any())


def contact(facts: Facts, scanned: Iterable[Scan]) -> list[tuple[int, int]]:
    """(cycle, level) of every change of the contact pin."""
    changes = []
    level = 0
    for scan in scanned:
        for row, cycle in enumerate(scan.offered):
            last = row == facts.rows - 1
            if scan.cells[row].any():
                new = 1
            elif last and not scan.cells.any():
                new = 0
            else:
                new = level
            if new != level:
                changes.append((cycle, new))
            level = new
    return changes


def row_slots(facts: Facts, frame: int) -> range:
    """Slots of a frame's rows; a guard row's slot is before them."""
    end = (frame + 1) * facts.row_lines
    return range(end - facts.rows, end)


def _row(facts: Facts, slot: int) -> int:
    return (slot - (facts.row_lines - facts.rows)) % facts.row_lines


def _line(facts: Facts, slot: int) -> int:
    return (*(facts.skin.row_order or range(facts.rows)), facts.rows)[_row(facts, slot)]


def _read(facts: Facts, timeline: Timeline, slot: int, ahead: int = 0) -> np.ndarray:
    """(column lines,) bool: columns read as pressed ``ahead`` clocks before the settle time's end."""
    cycle = sampled(facts, slot) - ahead
    return np.asarray(closed(facts, timeline, cycle)[_row(facts, slot)] | stuck(facts, timeline, cycle))


def _stuck(facts: Facts, timeline: Timeline, frame: int) -> np.ndarray:
    """(column lines,) bool: columns that read pressed with no row driven, from the sample before the first slot to the
    one before the last."""
    columns = np.zeros(facts.column_lines, bool)
    for slot in range(max(0, frame * facts.row_lines), (frame + 1) * facts.row_lines):
        if slot:
            columns |= stuck(facts, timeline, facts.first_slot + slot * facts.row_clocks - 1)
    return columns


def checks(facts: Facts, timeline: Timeline, count: int, requests: Sequence[Request] = ()) -> list[Changes]:
    """By frame (cycle, word) of each check. A frame sampled early has no row checks."""
    if not facts.skin.guard:
        return [[]] * count
    faulty, result = FaultyLines(facts), []
    for frame, ((ahead, *_), checks_rows) in enumerate(_instants(facts, timeline, requests, count)):
        changes, renews = [], _renews(facts, frame)
        slots = row_slots(facts, frame)
        faulty.check("columns", ~_read(facts, timeline, slots[0] - 1)[: facts.columns], renews)
        changes.append((strobe(facts, slots[0] - 1) + 1, faulty.word))
        for row, slot in enumerate(slots):
            whole = _read(facts, timeline, slot, ahead)[-1]
            if checks_rows:
                faulty.check("rows", np.full(facts.rows, not whole), renews, row)
            if slot == slots[-1]:
                faulty.check("stuck", _stuck(facts, timeline, frame), renews)
            changes.append((strobe(facts, slot) + 1, faulty.word))
        result.append(changes)
    return result


def _renews(facts: Facts, frame: int) -> bool:
    """Whether a frame's checks end obsolete reports, as the us clock passed a multiple of 2^16 in the previous
    frame."""
    late = facts.column_shift + (facts.rows - 1) * facts.row_clocks

    def retries(ended: int) -> int:
        return (
            0
            if ended < 0
            else (strobe(facts, row_slots(facts, ended)[-1]) - late) // (guard.RETRY_US * facts.clocks_per_us)
        )

    return retries(frame - 1) != retries(frame - 2)
