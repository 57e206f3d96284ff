"""The scanner of line reversal alone: the stages after it stall, lines lie, switches are masked, columns are stuck."""

import dataclasses
import itertools

import pytest
from amaranth.hdl import Cat
from bench import Bench, Drive
from reversal import Slot, frames, projected, slots, small

from contactfpga.skin import Skin
from contactfpga_hdl.scan import frame_clock, precharge, reversal
from contactfpga_hdl.scan.reversal import ReversalScanner
from contactfpga_sim.model.golden import guard


@dataclasses.dataclass(frozen=True)
class State:
    """State of the simulated sheet: bit c of ``cells[r]`` is a closed switch; ``lifted`` rows read touched though
    nothing feeds them; ``stuck`` columns read pressed."""

    cells: list[int]
    stuck: int = 0
    lifted: int = 0


class Sheet:
    """Levels at the pins, and what they were in each cycle."""

    def __init__(self, skin: Skin, at):
        self.skin, self.at = skin, at
        self.selected: list[int] = []
        self.columns: list[int] = []  # those that are driven

    def levels(self, cycle: int, word: int) -> int:
        skin, state = self.skin, self.at(cycle)
        everything = (1 << skin.rows) - 1
        rows, drive, columns = word & everything, word >> skin.rows & everything, word >> 2 * skin.rows
        selected = (~rows if skin.selects_low else rows) & drive
        self.selected.append(selected)
        self.columns.append(columns)
        assert drive in (0, everything), f"cycle {cycle}: some rows are let go, others are not"
        pulled = touched = 0
        for row, cells in enumerate(state.cells):
            pulled |= cells if selected >> row & 1 else 0
            touched |= (cells & columns & ~state.stuck != 0) << row
        assert not pulled & columns, f"cycle {cycle}: lines are driven against each other"
        touched |= state.lifted
        let_go = touched if skin.selects_low else touched ^ everything
        drained = 0  # by rows that are let go and that nothing lifts
        for row, cells in enumerate(state.cells):
            drained |= cells if not drive and not touched >> row & 1 else 0
        pressed = pulled | state.stuck | drained & ~columns
        read = pressed ^ (1 << skin.columns) - 1 if skin.selects_low else pressed
        return read | (rows & drive | let_go & ~drive) << skin.columns


@dataclasses.dataclass
class Life:
    """Levels and rows of a scanner, cycle by cycle."""

    sheet: Sheet
    slots: list[Slot]
    taken: list[tuple[int, int, int, bool]]
    """(cycle, number, cells, last) of each row; the number is that on the stream where rows are skipped."""
    ends: list[int]
    """Cycles in which a frame was packed."""
    contact: list[int]
    stuck: list[int]
    motion: list[int]


def live(skin: Skin, at, cycles: int, ready=None, late=lambda: 2) -> Life:
    """A scanner at a sheet; a frame is packed ``late`` clocks after its last row is taken."""
    dut, sheet = ReversalScanner(skin), Sheet(skin, at)
    bench = Bench(dut)
    pins, ends, ended = dut.pins, [], [0]
    driven = Cat(pins.rows, pins.rows_drive, pins.columns_drive)
    bench._add(Drive(Cat(pins.columns, pins.rows_read), sheet.levels, driven))
    sink = bench.sink(dut.rows, ready=ready)
    last = skin.columns

    def is_packed(cycle: int) -> int:
        while ended[0] < len(sink.transfers):
            taken, word = sink.transfers[ended[0]]
            ended[0] += 1
            if word >> last & 1:
                ends.append(max(cycle, taken + late()))
        return int(cycle in ends[-2:])

    bench.drive(dut.packed, is_packed)
    contact, stuck, motion, fault = map(bench.watch, (dut.contact, dut.tag.stuck, dut.tag.motion, dut.tag.fault))
    bench.run(cycles)
    assert fault.values == [int(count > 0) for count in stuck.values]
    words = sheet.selected
    changes = [(cycle, word) for cycle, word in enumerate(words) if word != (words[cycle - 1] if cycle else 0)]
    taken = [
        (cycle, word >> last + 1, word & (1 << last) - 1, bool(word >> last & 1)) for cycle, word in sink.transfers
    ]
    return Life(sheet, slots(changes, cycles), taken, ends, contact.values, stuck.values, motion.values)


def changing(rng, skin: Skin, cycles: int, lifts: bool = False):
    """Cells that come and go at any cycle; with ``lifts`` rows that read touched for no reason."""
    states, state = [], State([0] * skin.rows)
    for _ in range(cycles):
        if rng.random() < 1 / 60:
            shares = [(rng.random() < 0.5 and rng.getrandbits(skin.columns)) or 0 for _ in range(skin.rows)]
            state = State(shares if rng.random() < 0.7 else [0] * skin.rows)
        if lifts and rng.random() < 1 / 20:
            state = dataclasses.replace(state, lifted=rng.getrandbits(skin.rows) & rng.getrandbits(skin.rows))
        states.append(state)
    return states.__getitem__


def present(skin: Skin, row: int) -> int:
    return sum(1 << column for column in range(skin.columns) if (row, column) not in skin.mask)


def check_rows(skin: Skin, life: Life, at) -> int:
    """Rows come frame by frame in ascending order, each with what it read in its one slot; the next row is driven when
    it was taken, and the next frame's when it was packed; and all that was closed from a frame's first sample to its
    last is in it. Returns the number of rows with a pressed cell."""
    read = {slot: at(slot.sample).cells[slot.row] & present(skin, slot.row) for slot in life.slots}
    numbers = [index % skin.rows if skin.report == "cells" else row[1] for index, row in enumerate(life.taken)]
    given = [(number, row[2], row[0]) for number, row in zip(numbers, life.taken) if row[2]]
    wanted = [(slot.row, cells) for slot, cells in read.items() if cells]
    assert [row[:2] for row in given] == wanted[: len(given)]
    assert len(wanted) - len(given) <= 1, "one may be on its way"
    for before, row in itertools.pairwise(life.taken):
        if skin.report != "cells" and not before[3]:
            assert row[1] > before[1], "rows ascend"
            assert row[1] == before[1] + 1 or not before[2], "an empty row parts those that are no neighbors"
    reported = [slot for slot, cells in read.items() if cells]
    for slot, row in zip(reported, given):
        following = next((other.begin for other in life.slots if other.begin > slot.begin), None)
        assert following is None or following >= row[2] + 4
    for frame in frames(life.slots, life.ends):
        assert [slot.row for slot in frame] == sorted({slot.row for slot in frame})
        if not any(end > frame[-1].sample for end in life.ends):
            continue  # under way
        for row in range(skin.rows):
            closed = present(skin, row)
            for cycle in range(frame[0].begin - projected(skin), frame[-1].sample + 1):
                closed &= at(cycle).cells[row]
            cells = next((read[slot] for slot in frame if slot.row == row), 0)
            assert not closed & ~cells, f"row {row} of the frame from {frame[0].begin} on"
    return len(given)


def check_motion(skin: Skin, life: Life, at) -> set[bool]:
    """A frame tells of motion where a row that it drove had no pressed cell, but not of rows with a masked switch; an
    untouched sheet does not. Returns what frames reported."""
    reported = {False}
    driven = frames(life.slots, life.ends)
    ends = [end for end in life.ends if end < len(life.motion)]
    begun = [next((end for end in ends if end > frame[-1].sample), None) for frame in driven]
    for frame, end in zip(driven, begun):
        if end is None:
            continue  # under way
        clean = [slot for slot in frame if present(skin, slot.row) == (1 << skin.columns) - 1]
        moved = any(not at(slot.sample).cells[slot.row] for slot in clean)
        assert life.motion[end] == moved, frame
        reported.add(moved)
    assert not any(life.motion[end] for end in ends if end not in begun)
    return reported


def check_pins(life: Life) -> None:
    """While columns are driven, in the clock before and in the one after, no row is selected; one is at most."""
    for cycle, rows in enumerate(life.sheet.selected):
        assert rows.bit_count() <= 1, cycle
        assert not rows or not any(life.sheet.columns[max(0, cycle - 1) : cycle + 2]), cycle


CYCLES = 1500
STALLS = [
    {"rows": 5, "columns": 3, "mask": ((1, 1), (4, 0))},
    {"rows": 4, "columns": 2, "report": "cells", "diodes": "row2col"},
    {"rows": 6, "columns": 1, "diodes": "row2col", "precharge_us": 0.25},
    {"rows": 4, "columns": 3, "mask": ((1, 1), (3, 0)), "debounce": "sym_defer_pk", "debounce_press_us": 1.0,
     "debounce_release_us": 1.0},
]  # fmt: skip


@pytest.mark.parametrize("fields", STALLS, ids=lambda fields: f"{fields['rows']}x{fields['columns']}")
@pytest.mark.parametrize("share", [0.0, 0.7, 0.95], ids=lambda share: f"stalls-{share}")
def test_a_scan_waits_for_rows_and_frames_with_its_lines_safe_and_loses_nothing(rng, fields, share):
    skin = small(**fields)
    at = changing(rng, skin, CYCLES + 1)
    life = live(skin, at, CYCLES, lambda cycle: rng.random() >= share, lambda: rng.choice([1, 2, 30, 200]))
    assert check_rows(skin, life, at) > 3
    check_motion(skin, life, at)
    check_pins(life)


@pytest.mark.parametrize("fields", STALLS, ids=lambda fields: f"{fields['rows']}x{fields['columns']}")
def test_rows_that_read_touched_for_no_reason_cost_slots_and_change_nothing_else(rng, fields):
    """A row that reads touched without a touch, by coupling for instance, gets a slot, and its cells come from that
    slot."""
    skin = small(**fields)
    at = changing(rng, skin, CYCLES + 1, lifts=True)
    life = live(skin, at, CYCLES)
    assert check_rows(skin, life, at) > 3
    assert check_motion(skin, life, at) == {False, True}
    check_pins(life)
    empty = [slot for slot in life.slots if not at(slot.sample).cells[slot.row]]
    assert len(empty) > 3


def test_contact_is_not_raised_by_masked_switches_nor_by_rows_that_lie():
    """A row with a masked switch cannot tell which one it is before it is driven; its other switches raise the pin
    when their row's sample is there."""
    skin = small(rows=3, columns=3, mask=((0, 0), (0, 1), (0, 2), (1, 1)))
    touches = {100: [7, 2, 0], 300: [0, 0, 0], 400: [0, 2, 0], 500: [0, 3, 0], 700: [0, 0, 0], 800: [0, 0, 4]}
    states = [State([0, 0, 0])]
    for cycle in range(1001):
        cells = touches.get(cycle, states[-1].cells)
        states.append(State(cells, lifted=1 << cycle // 10 % 3 if 600 > cycle > 550 else 0))
    life = live(skin, lambda cycle: states[cycle + 1], 1000)
    assert not any(slot.row == 0 for slot in life.slots), "a row that is masked whole is not driven"
    edges = [
        (cycle, level) for cycle, level in enumerate(life.contact) if level != (life.contact[cycle - 1] if cycle else 0)
    ]
    (rise, up), (fall, down), (again, _) = edges
    first = next(slot for slot in life.slots if slot.sample >= 500)
    assert (rise, up, down) == (first.sample + 3, 1, 0)
    assert 700 < fall < 800
    assert again == 803


def test_a_row_that_lies_at_rest_raises_contact_until_its_slot():
    """The pin is fast, not sure: a false row looks as a touch does until it was driven."""
    skin = small(rows=3, columns=3)
    life = live(skin, lambda cycle: State([0, 0, 0], lifted=2 * (100 <= cycle < 104)), 300)
    assert life.contact.index(1) == 103
    assert sum(life.contact) < 30
    assert not life.contact[-1]
    assert all(not row[2] for row in life.taken)


@pytest.fixture
def soon(monkeypatch) -> int:
    """A column that is stuck is tried after this many us."""
    monkeypatch.setattr(reversal, "RETRY_BIT", 9)
    return 2**9


def test_retries_are_every_65_ms():
    assert frame_clock.RETRY_BIT == reversal.RETRY_BIT == 16
    assert guard.RETRY_US == 2**16


SLOW = {"clock_hz": 1_000_000, "baud": 100_000, "precharge_us": 1.0, "settle_us": 2.0, "project_us": 2.0}
FRAME = 11
WINDOW = precharge.LOOKS * (16 + FRAME)
"""Clocks of one at most, with such times and a frame that never waits."""


def fought(life: Life, column: int, stuck: range) -> list[int]:
    """Cycles in which the column is driven while it is stuck."""
    return [cycle for cycle in stuck if life.sheet.columns[cycle] >> column & 1]


@pytest.mark.parametrize("touched", [True, False], ids=["touched", "at rest"])
def test_a_stuck_column_is_reported_and_not_driven_until_it_is_tried(soon, touched):
    """Two windows find it, of which the first began before. Then it is tried, for a window each, and
    reported meanwhile."""
    skin = small(rows=2, columns=3, mask=((0, 0), (1, 0)), release_us=1.0, **SLOW)
    stuck = range(140, 3 * soon - 20)
    life = live(skin, lambda cycle: State([0, 0b100 * touched], 0b010 * (cycle in stuck)), 4 * soon)
    columns = life.sheet.columns
    assert set(columns) <= {0, 0b100, 0b110}, "a column without a switch is never driven"
    assert 0b100 not in columns[:140] + columns[-100:]
    against = fought(life, 1, stuck)
    assert not any(stuck.start + 2 * WINDOW < cycle < soon for cycle in against), "held back"
    for turn in (soon, 2 * soon):
        tried = [cycle for cycle in against if turn <= cycle < turn + 2 * WINDOW]
        assert max(tried) - min(tried) >= 3 * 16, "tried"
        assert not any(turn + 2 * WINDOW <= cycle < turn + soon for cycle in against), "and held back again"
    if touched:
        first = next(cycle for cycle, count in enumerate(life.stuck) if count)
        assert 140 + 3 * 16 < first <= 140 + 2 * WINDOW + 5
        assert sum(life.stuck[first : stuck.stop]) == stuck.stop - first
        assert life.stuck[3 * soon + 2 * WINDOW + 5] == 0


@pytest.mark.parametrize("clocks", range(1, 9))
def test_a_column_that_reads_pressed_for_up_to_eight_clocks_is_driven_on(rng, clocks):
    """A column is still driven after it read pressed for at most eight clocks, at rest and in frames, from any clock
    on."""
    skin = small(rows=2, columns=2, release_us=1.0, **SLOW)
    starts = list(itertools.accumulate(rng.randrange(80, 130) for _ in range(20)))
    wrong = {start + more: 1 << rng.randrange(2) for start in starts for more in range(clocks)}
    life = live(skin, lambda cycle: State([0b10 * (cycle // 256 % 2), 0], wrong.get(cycle, 0)), starts[-1] + 100)
    assert set(life.sheet.columns) == {0, 0b11}
    assert not any(life.stuck)


def test_a_touch_of_a_column_that_was_let_go_is_seen_when_it_is_tried(soon):
    """A touch keeps a released column at its row's level, as if it were still stuck, and is seen when the column is
    driven again."""
    skin = small(rows=2, columns=2, release_us=1.0, **SLOW)
    life = live(skin, lambda cycle: State([0b01 * (cycle >= 300), 0], 0b01 * (20 <= cycle < 200)), 2 * soon)
    assert not life.sheet.columns[300] & 1
    seen = life.contact.index(1, 300)
    assert soon < seen <= soon + WINDOW
    assert life.sheet.columns[-1] & 1 or not life.sheet.columns[-1]
    assert not life.stuck[-1]
    assert life.contact[-1]
