"""Sheets scanned by line reversal: Skins, what touches them, and what is seen at their pins."""

import dataclasses
import itertools

import numpy as np

from contactfpga import examples
from contactfpga.skin import Skin
from contactfpga_hdl.scan import reversal, reversal_guard
from contactfpga_hdl.scan.precharge import Precharge
from contactfpga_sim.model.golden import Timeline, guard, requests
from contactfpga_sim.model.golden import reversal_lines as golden_guard
from contactfpga_sim.model.golden.facts import facts
from contactfpga_sim.verify.cosim import record

FAST = Skin.load(examples() / "fast.toml")
"""The reference sheet; tests share its compiled board."""


def projected(skin: Skin) -> int:
    """Clocks from the sample of the touched rows to the first clock in which one of them is driven; more where columns
    must have been driven for longer by then."""
    return 6 + max(0, facts(skin).precharge - facts(skin).project - 4)


def small(**fields) -> Skin:
    """A Skin whose row times take few clocks."""
    times = {"precharge_us": 0.04, "settle_us": 0.1, "release_us": 0.05, "project_us": 0.2}
    rates = {"clock_hz": 24_000_000, "baud": 12_000_000, "send": "on_change"}
    return Skin(**{"scan": "reversal", "rows": 3, "columns": 4, **times, **rates, **fields})


def checked_soon(monkeypatch, check_bit: int = 5, retry_bit: int = 8) -> None:
    """A sheet at rest is checked every 2^check_bit us, and what is reported is renewed every 2^retry_bit us."""
    monkeypatch.setattr(reversal, "RETRY_BIT", retry_bit)
    monkeypatch.setattr(guard, "RETRY_US", 2**retry_bit)
    for module in (reversal, reversal_guard):
        monkeypatch.setattr(module, "CHECK_BIT", check_bit)
    monkeypatch.setattr(golden_guard, "CHECK_US", 2**check_bit)


def never_let_go(monkeypatch) -> None:
    """A fault of the gateware: it drives its columns all the time."""
    elaborate = Precharge.elaborate

    def wrong(self, platform):
        m = elaborate(self, platform)
        m.d.sync += self.pins.eq(-1)
        return m

    monkeypatch.setattr(Precharge, "elaborate", wrong)


def noted_pins(monkeypatch) -> list[dict[str, int]]:
    """Levels of the top's outputs to the sheet, cycle by cycle, of each board that is put into Amaranth's simulator."""
    noted: list[dict[str, int]] = []
    step = record.InputDriver.pins

    def note(self, cycle, levels):
        noted.append(dict(levels))
        return step(self, cycle, levels)

    monkeypatch.setattr(record.InputDriver, "pins", note)
    return noted


def selected(skin: Skin, levels: dict[str, int]) -> int:
    """Rows that are driven to the selecting level."""
    return levels["rows_drive"] & (~levels["rows"] if skin.selects_low else levels["rows"])


def selected_changes(skin: Skin, pins: list[dict[str, int]]) -> list[tuple[int, int]]:
    """(cycle, rows) of every change of the rows that are driven to the selecting level."""
    words = [selected(skin, levels) for levels in pins]
    return [(cycle, word) for cycle, word in enumerate(words) if word != (words[cycle - 1] if cycle else 0)]


def any_skin(rng) -> Skin:
    """Any choice of what a scan by line reversal works with."""
    rows, columns = rng.randint(1, 9), rng.randint(1, 9)
    fields = {
        "rows": rows,
        "columns": columns,
        "connectivity": rng.choice([4, 8]),
        "diodes": rng.choice(["col2row", "row2col"]),
        "labeller": rng.choice(["run", "serial", "projection", "single"]),
        "report": rng.choice(["moments", "moments", "barycenter", "cells"]),
        "send": rng.choice(["always", "on_change"]),
        "debounce": rng.choice(["none", "sym_defer_pk", "asym_eager_defer_pk"]),
        "precharge_us": rng.choice([0.04, 0.25, 1.2]),
        "settle_us": rng.choice([0.1, 0.5]),
        "project_us": rng.choice([0.05, 0.2, 1.0]),
        "baud": rng.choice([12_000_000, 6_000_000, 3_000_000]),
        "debounce_press_us": rng.choice([0, 7, 30]),
        "debounce_release_us": rng.choice([0, 7, 30]),
    }
    if fields["debounce"] == "none":
        fields |= {"debounce_press_us": 0, "debounce_release_us": 0}
    if rows * columns > 3:
        masked = {(rng.randrange(rows), rng.randrange(columns)) for _ in range(rng.choice([0, 0, 2]))}
        if columns > 1 and rng.random() < 0.2:
            masked |= {(row, columns // 2) for row in range(rows)}
        fields["mask"] = tuple(masked)
    return small(**fields)


def touches(skin: Skin, rng, cycles: int, stuck: float = 0.05) -> Timeline:
    """Fingertips, any cells or none, for any time; columns that are stuck; requests at any time."""
    pieces, start = [], rng.randrange(300)
    while start < cycles:
        cells = np.zeros((skin.rows, skin.columns), bool)
        if (kind := rng.random()) < 0.4:
            y, x = rng.randrange(skin.rows), rng.randrange(skin.columns)
            cells[y : y + rng.randint(1, 3), x : x + rng.randint(1, 3)] = True
        elif kind < 0.7:
            share = rng.choice([0.1, 0.5, 0.9])
            cells = np.array([[rng.random() < share for _ in range(skin.columns)] for _ in range(skin.rows)])
        lines = np.array([rng.random() < 0.3 for _ in range(skin.columns)]) if rng.random() < stuck else None
        pieces.append((start, cells, lines))
        start += rng.randint(1, rng.choice([5, 60, 900]))
    asked = sorted(rng.sample(range(cycles), 3))
    return Timeline(pieces, requests(asked, facts(skin).bit_clocks))


@dataclasses.dataclass(frozen=True)
class Slot:
    """A row that was driven from the cycle ``begin`` to the cycle ``sample``."""

    row: int
    begin: int
    sample: int


def slots(changes, cycles: int) -> list[Slot]:
    """From (cycle, rows) of every change of the driven rows, one at a time."""
    found = []
    for (begin, rows), (end, after) in itertools.pairwise(changes):
        if rows:
            assert rows.bit_count() == 1, f"cycle {begin}: rows {rows:#b} are driven together"
            assert after == 0, f"cycle {end}: no gap between two rows"
            found.append(Slot(rows.bit_length() - 1, begin, end - 1))
    return [slot for slot in found if slot.sample < cycles]


def frames(found: list[Slot], ends: list[int]) -> list[list[Slot]]:
    """The slots of each frame that has any: the next frame begins after the end mark of the one before."""
    last = None
    parted: list[list[Slot]] = []
    for slot in found:
        ended = sum(end < slot.begin for end in ends)
        if ended != last:
            parted.append([])
        parted[-1].append(slot)
        last = ended
    return parted


def pressed(skin: Skin, timeline: Timeline, cycle: int) -> np.ndarray:
    """(R, C) bool: what reads pressed in a row that is driven in this cycle."""
    cells, lines = timeline.at(cycle)
    read = np.zeros((skin.rows, skin.columns), bool) if cells is None else np.array(cells, bool)
    if lines is not None:
        read |= lines
    for place in skin.mask:
        read[place] = False
    return read


def held(skin: Skin, timeline: Timeline, begin: int, end: int) -> np.ndarray:
    """(R, C) bool: cells that are closed in each of these cycles, in columns that are not stuck in any."""
    inside = [piece[0] for piece in timeline.pieces if begin < piece[0] <= end]
    closed = np.ones((skin.rows, skin.columns), bool)
    for cycle in (begin, *inside):
        cells, lines = timeline.at(cycle)
        closed &= False if cells is None else np.array(cells, bool)
        if lines is not None:
            closed &= ~lines
    for place in skin.mask:
        closed[place] = False
    return closed
