"""Line reversal: gateware and golden model in lockstep, what is at the pins, and every frame against the truth."""

import random

import numpy as np
import pytest
from reversal import (
    any_skin,
    frames,
    held,
    noted_pins,
    pressed,
    projected,
    selected,
    selected_changes,
    slots,
    small,
    touches,
)
from toy_labeller import TOY
from zone_oracles import zones_by_scipy

from contactfpga.skin import Skin
from contactfpga.skin.derived import Widths
from contactfpga_sim.model.golden import Timeline, Trace, driven, predict
from contactfpga_sim.verify.cosim import bench_amaranth
from contactfpga_sim.verify.cosim.compare import compare
from contactfpga_sim.verify.cosim.covering import REVERSAL, pairwise, skin_for, stimulus

COVERING = pairwise(REVERSAL)


@pytest.fixture
def pins(monkeypatch) -> list[dict[str, int]]:
    return noted_pins(monkeypatch)


def check_pins(skin: Skin, pins: list[dict[str, int]]) -> None:
    """Check the pins: none is driven at power-up; a selected row is alone while others are held; no row is selected
    while columns are driven, a clock before and a clock after. Rows are released together."""
    everything = (1 << skin.rows) - 1
    assert pins[0]["columns_drive"] == 0
    assert selected(skin, pins[0]) == 0
    for cycle, levels in enumerate(pins):
        rows = selected(skin, levels)
        assert rows.bit_count() <= 1, cycle
        assert levels["rows_drive"] in (0, everything), cycle
        if rows:
            near = pins[max(cycle - 1, 0) : cycle + 2]
            assert not any(other["columns_drive"] for other in near), cycle
            assert all(other["rows_drive"] == everything for other in near), cycle


def reported(skin: Skin, trace: Trace) -> list[tuple[int, list[int]]]:
    """(cycle of the end mark, records) of each frame."""
    found, records = [], []
    for cycle, data, end in trace.records:
        if end:
            found.append((cycle, records))
            records = []
        else:
            records.append(data)
    return found


def moments(skin: Skin, record: int) -> tuple[int, int, int]:
    widths = Widths(skin.sheet)
    area, sum_x = widths.area_bits, widths.sum_x_bits
    return record & (1 << area) - 1, record >> area & (1 << sum_x) - 1, record >> area + sum_x


def check_truth(skin: Skin, timeline: Timeline, trace: Trace, changes: list[tuple[int, int]]) -> int:
    """Check that each frame holds the cells that read pressed in its slots, all that were closed from its first sample
    to its last, and no others. Returns the number of frames with a slot."""
    found = reported(skin, trace)
    parted = frames(slots(changes, trace.cycles), [end for end, _ in found])
    begins = [frame[0].begin for frame in parted]
    checked = 0
    for end, records in found:
        before = [index for index, begin in enumerate(begins) if begin < end]
        first = bool(before) and not any(begins[before[-1]] < other < end for other, _ in found)
        seen = np.zeros((skin.rows, skin.columns), bool)
        if first:
            frame = parted[before[-1]]
            rows = [slot.row for slot in frame]
            assert rows == sorted(set(rows))
            for slot in frame:
                seen[slot.row] = pressed(skin, timeline, slot.sample)[slot.row]
            closed = held(skin, timeline, frame[0].begin - projected(skin), frame[-1].sample)
            # A column that read stuck a while ago is not driven, so its switches do not make their rows answer.
            assert not (closed & ~seen).any() or any(piece[2] is not None for piece in timeline.pieces), end
            checked += 1
        if skin.report == "cells":
            wanted = [int(sum(1 << int(x) for x in np.flatnonzero(row))) for row in seen]
            assert records == wanted, f"frame with the end mark at {end}"
        elif skin.labeller in ("run", "serial"):
            assert sorted(moments(skin, one) for one in records) == zones_by_scipy(seen, skin.connectivity), end
    return checked


def check_life(skin: Skin, rng: random.Random, cycles: int, pins: list[dict[str, int]]) -> int:
    """Check a board's run: lockstep, its pins, the rows it drives, and its frames. Returns the number of events."""
    pins.clear()
    timeline = touches(skin, rng, cycles)
    trace = bench_amaranth.run(skin, timeline, cycles)
    count = compare(predict(skin, timeline, cycles), trace)
    check_pins(skin, pins)
    assert selected_changes(skin, pins) == driven(skin, timeline, cycles)
    if skin.debounce == "none":
        check_truth(skin, timeline, trace, selected_changes(skin, pins))
    return count


TIMES = {"debounce_press_us": 7.0, "debounce_release_us": 12.0}
SAMPLE = [
    {"rows": 4, "columns": 5, "labeller": "run", "connectivity": 4, "mask": ((1, 1), (3, 0))},
    {"rows": 5, "columns": 3, "report": "cells", "debounce": "sym_defer_pk", "send": "always", **TIMES},
    {"rows": 3, "columns": 6, "labeller": "serial", "diodes": "row2col", "debounce": "asym_eager_defer_pk", **TIMES},
    {"rows": 5, "columns": 4, "labeller": "single", "send": "always"},
    {"rows": 4, "columns": 5, "labeller": TOY.name, "send": "always"},
    {"rows": 4, "columns": 64, "labeller": "serial", "connectivity": 4},
    {"rows": 3, "columns": 4, "labeller": "run", "precharge_us": 1.2},
    {"rows": 6, "columns": 2, "labeller": "projection", "report": "barycenter", "send": "always", "baud": 3_000_000},
]


@pytest.mark.parametrize(
    "fields", SAMPLE, ids=lambda fields: f"{fields['rows']}x{fields['columns']}-{fields.get('labeller', 'run')}"
)
def test_gateware_does_what_the_golden_model_says_and_frames_are_true(rng, pins, fields):
    """Random Skins of all labellers; the serial one takes up to 130 clocks for a row of 64 columns, and the scan waits
    for it."""
    assert check_life(small(**fields), rng, 1600, pins) > 150


@pytest.mark.campaign
@pytest.mark.parametrize("number", range(len(COVERING)))
def test_covering_set_in_amaranths_simulator(pins, number):
    """Skins with every pair of choices; cells change more slowly than in other tests, and more columns are stuck."""
    skin, cycles = skin_for(COVERING[number]), 5000
    timeline = stimulus(skin, cycles, number)
    assert compare(predict(skin, timeline, cycles), bench_amaranth.run(skin, timeline, cycles)) > 300
    check_pins(skin, pins)


@pytest.mark.campaign
@pytest.mark.timeout(7200)
@pytest.mark.parametrize("seed", range(150))
def test_any_skin_does_what_the_golden_model_says_and_frames_are_true(pins, seed):
    rng = random.Random(seed)
    assert check_life(any_skin(rng), rng, 6000, pins) > 100
