"""The audit of a frame's records against its cells, and the bitmap in its place."""

import dataclasses
import itertools
import math

import pytest

from contactfpga import Skin
from contactfpga_hdl.report.audit import Audit
from contactfpga_hdl.report.bitmap import Bitmap

SHEETS = ((1, 1), (1, 9), (9, 1), (5, 7), (6, 16))
AT_END = ("zones", "overflow", "changed")  # there one clock after the end mark
COUNTED = ("cells", "mismatch")  # there when the last row is counted as well


def skin_of(rows, columns, **options):
    return Skin(rows=rows, columns=columns, settle_us=200, **options)


def widths(rows, columns):
    """Bits of area, sum x and sum y in a record (docs/protocol.md)."""
    largest = (rows * columns, rows * sum(range(columns)), columns * sum(range(rows)))
    return [max(1, value.bit_length()) for value in largest]


def zones_of(frame, most=None):
    """Moments of a partition of the frame's cells, which need not be connected: its runs, at most ``most``."""
    zones = []
    for y, word in enumerate(frame):
        xs = [x for x in range(word.bit_length()) if word >> x & 1]
        for _, run in itertools.groupby(enumerate(xs), key=lambda pair: pair[1] - pair[0]):
            run = [x for _, x in run]
            zones.append([len(run), sum(run), len(run) * y])
    while most is not None and len(zones) > most:
        zones.append([a + b for a, b in zip(zones.pop(), zones.pop(0))])
    return zones


def random_frame(rng, rows, columns):
    density = rng.random()
    return [sum(1 << x for x in range(columns) if rng.random() < density) for _ in range(rows)]


@dataclasses.dataclass
class Schedule:
    """Cycles in which rows are taken and records may be offered; the end mark comes three clocks after the last row."""

    rows: dict  # cycle: (word, last)
    records: list  # (not before this cycle, moments or None for an end mark)


def schedule(rng, frames, records, sheet):
    """Rows as close as the shortest row time has them; after each at most as many records as it has columns."""
    plan, cycle = Schedule({}, []), 1
    row_clocks = max(10, sheet[1] + 6)
    for frame, zones in zip(frames, records, strict=True):
        after = []
        for y, word in enumerate(frame):
            plan.rows[cycle] = word, y == len(frame) - 1
            last = cycle
            after += sheet[1] * [cycle + 2]
            cycle += row_clocks
        moments = sorted(rng.sample(after, len(zones)))
        plan.records += list(zip(moments, zones)) + [(last + 3, None)]
        cycle = max(cycle, last + len(zones) + 12) + rng.randrange(3)
    return plan


def record_word(zone, rows, columns):
    area, sum_x, sum_y = widths(rows, columns)
    if zone is None:
        return 1 << area + sum_x + sum_y
    word, offset = 0, 0
    for value, width in zip(zone, (area, sum_x, sum_y)):
        word |= value % (1 << width) << offset
        offset += width
    return word


def run(bench, dut, plan, sheet, rng, ready=None):
    """Feed the plan to the audit; returns the items' sink, the records' source, and a summary for each end mark."""
    rows, columns = sheet
    sim = bench(dut)
    noise = [rng.randrange(2 << columns) for _ in range(17)]
    words = {cycle: word | last << columns for cycle, (word, last) in plan.rows.items()}
    sim.drive(dut.taken, lambda cycle: int(cycle in words))
    sim.drive(dut.row, lambda cycle: words.get(cycle, noise[cycle % 17]))
    source = sim.source(
        dut.records,
        [record_word(zone, rows, columns) for _, zone in plan.records],
        not_before=[cycle for cycle, _ in plan.records],
    )
    items = sim.sink(dut.items, ready=ready or (lambda cycle: True))
    fields = {name: sim.watch(dut.summary[name]) for name in (*AT_END, *COUNTED)}
    sim.run(plan.records[-1][0] + 40 * len(plan.records) + 100)
    assert source.done
    ends = [cycle for cycle, (_, zone) in zip(source.transfers, plan.records) if zone is None]
    lasts = [cycle for cycle, (_, last) in plan.rows.items() if last]
    summaries = []
    for end, last, following in zip(ends, lasts, [*ends[1:], None]):
        # What is counted may hold up to a clock per zone, and the zones are before the end mark.
        since = dict.fromkeys(AT_END, end + 1) | {name: max(last + 7, end + 2) + end - last for name in COUNTED}
        summaries.append({name: watch[since[name]] for name, watch in fields.items()})
        for name, watch in fields.items():
            assert len(set(watch.values[since[name] : following and following + 1])) == 1, f"{name} holds"
    return items, source, summaries


@pytest.mark.parametrize("sheet", SHEETS)
def test_records_pass_without_delay_and_add_up_with_the_cells(bench, rng, sheet):
    frames = [random_frame(rng, *sheet) for _ in range(8)] + [[(1 << sheet[1]) - 1] * sheet[0], [0] * sheet[0]]
    zones = [zones_of(frame, most=math.ceil(sheet[0] * sheet[1] / 2)) for frame in frames]
    for group in zones:
        rng.shuffle(group)
    plan = schedule(rng, frames, zones, sheet)
    dut = Audit(skin_of(*sheet, connectivity=4))
    items, source, summaries = run(bench, dut, plan, sheet, rng)
    end = dut.items.payload.shape()["end"].offset
    assert [cycle for cycle, _ in items.transfers] == source.transfers
    wanted = [1 << end if zone is None else record_word(zone, *sheet) for _, zone in plan.records]
    assert [item if item >> end == 0 else 1 << end for _, item in items.transfers] == wanted
    for frame, group, summary in zip(frames, zones, summaries, strict=True):
        cells = sum(word.bit_count() for word in frame)
        wanted = {"cells": cells, "zones": len(group), "overflow": 0, "mismatch": 0, "changed": 1}
        assert summary == wanted


def planted(rng, zones, sheet):
    """(what is wrong, records with one fault) for each way in which records can be wrong."""
    index = rng.randrange(len(zones))
    for field, width in zip(range(3), widths(*sheet)):
        for bit in range(width):
            wrong = [list(zone) for zone in zones]
            wrong[index][field] ^= 1 << bit
            yield f"bit {bit} of field {field}", wrong
    yield "lost", zones[:index] + zones[index + 1 :]
    yield "twice", [*zones, zones[index]]
    swapped = [list(zone) for zone in zones]
    swapped[index][0] += 1
    swapped[(index + 1) % len(zones)][1] += 1
    yield "two fields", swapped


def test_one_wrong_record_is_flagged_in_its_frame_and_in_no_other(bench, rng):
    sheet = (5, 7)
    dut = Audit(skin_of(*sheet, connectivity=4))
    frame = [0b1011011, 0, 0b1110001, 0b0000100, 0b1010101]
    right = zones_of(frame)
    faults = list(planted(rng, right, sheet))
    records = [group for _, wrong in faults for group in (wrong, right)]
    _, _, summaries = run(bench, dut, schedule(rng, [frame] * len(records), records, sheet), sheet, rng)
    flags = [summary["mismatch"] for summary in summaries]
    for (name, _), flagged in zip(faults, flags[::2], strict=True):
        assert flagged, name
    assert not any(flags[1::2])


def changing_frames(rng, rows, columns, count):
    frames = [[0] * rows]
    for _ in range(count):
        frame = list(frames[-1])
        if rng.random() < 0.5:
            frame[rng.randrange(rows)] ^= 1 << rng.randrange(columns)
        frames.append(frame)
    return frames[1:], [int(a != b) for a, b in itertools.pairwise(frames)]


def test_changed_tells_frames_that_differ_from_the_one_before(bench, rng):
    sheet = (5, 7)
    frames, changed = changing_frames(rng, *sheet, 20)
    plan = schedule(rng, frames, [zones_of(frame) for frame in frames], sheet)
    dut = Audit(skin_of(*sheet, connectivity=4, send="on_change"))
    _, _, summaries = run(bench, dut, plan, sheet, rng)
    assert [summary["changed"] for summary in summaries] == changed
    assert set(changed) == {0, 1}


@pytest.mark.parametrize("sheet", [*SHEETS, (2, 64)])
@pytest.mark.parametrize("stall", [0.0, 0.5])
def test_bitmap_rows_pass_as_they_are_and_the_end_mark_follows_three_clocks_later(bench, rng, sheet, stall):
    rows, columns = sheet
    frames, changed = changing_frames(rng, *sheet, 10)
    dut = Bitmap(skin_of(*sheet, report="cells", send="on_change"))
    sim = bench(dut)
    words = [word | (y == rows - 1) << columns for frame in frames for y, word in enumerate(frame)]
    source = sim.source(dut.rows, words, not_before=[(columns + 10) * (index + 1) for index in range(len(words))])
    items = sim.sink(dut.items, rng, stall=stall)
    fields = {name: sim.watch(dut.summary[name]) for name in (*AT_END, *COUNTED)}
    sim.run((columns + 10) * len(words) + 160)
    end = dut.items.payload.shape()["end"].offset
    assert [item for _, item in items.transfers if not item >> end] == [word for frame in frames for word in frame]
    assert [cycle for cycle, item in items.transfers if not item >> end] == source.transfers
    ends = [index for index, (_, item) in enumerate(items.transfers) if item >> end]
    assert [items.offered[index] for index in ends] == [cycle + 3 for cycle in source.transfers[rows - 1 :: rows]]
    for index, frame, change in zip(ends, frames, changed, strict=True):
        after = items.transfers[index][0] + 5
        cells = sum(word.bit_count() for word in frame)
        wanted = {"cells": cells, "zones": 0, "overflow": 0, "mismatch": 0, "changed": change}
        assert {name: watch[after] for name, watch in fields.items()} == wanted
