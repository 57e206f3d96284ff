"""An adaptive scan is never later than a raster scan."""

import functools

import numpy as np
import pytest
from sample import sample

from contactfpga.skin import Skin
from contactfpga_sim.model.board.compiled import CompiledBoard
from contactfpga_sim.model.golden.facts import facts

# ---- no later than a raster scan


@functools.cache
def every_transition(patterns: int) -> np.ndarray:
    """A walk through all ordered pairs of different patterns."""
    walk = [0]
    for pattern in range(patterns):
        for other in range(pattern + 1, patterns):
            walk += [other, pattern]
        walk.append(min(pattern + 1, patterns - 1))
    return np.array(walk)


def lateness(skin: Skin, walk: np.ndarray, hold: int) -> np.ndarray:
    """Clocks from each change of the walk to the end of the first frame that has it, as have all that follow."""
    frames = (walk[:, None] >> np.arange(skin.rows) & 1).astype(bool)[:, :, None]
    with CompiledBoard(skin, ("rows",)) as board:
        board.hold(frames, hold)
        events = board.take("rows")
    count = len(events) // skin.rows
    words = events["data"][: count * skin.rows].reshape(count, skin.rows).astype(int)
    seen = (words << np.arange(skin.rows)).sum(axis=1)
    ends = events["cycle"][: count * skin.rows].reshape(count, skin.rows)[:, -1].astype(int)
    number = ends // hold
    wrong = np.flatnonzero(seen != walk[number])
    wrong = wrong[wrong + 1 < count]
    late = np.zeros(len(walk), int)
    np.maximum.at(late, number[wrong], ends[wrong + 1] - number[wrong] * hold)
    return late


DEBOUNCES = {
    "none": ({}, 0),
    "sym_defer_pk": ({"debounce": "sym_defer_pk"}, 2),
    "asym_eager_defer_pk": ({"debounce": "asym_eager_defer_pk"}, 2),
}


def skins_of(rows: int, debounce: dict, scans: int) -> tuple[Skin, Skin]:
    """The same sheet, raster and adaptive."""
    fields = {"rows": rows, "columns": 1, "settle_us": 2.0, "release_us": 1.0, **debounce}
    scan_us = 3.0 * rows
    fields |= {"debounce_press_us": scans * scan_us, "debounce_release_us": scans * scan_us}
    return Skin(**fields), Skin(scan="adaptive", **fields)


def worst_of_raster(skin: Skin, scans: int) -> int:
    """The first row closed just after its sample; then the debounce time, and the rest of the scan."""
    known = facts(skin)
    return (2 * skin.rows - 1 + scans * skin.rows) * known.row_clocks + 2 + known.debounced * (skin.columns + 3)


def check_transitions(rows: int, name: str, offset: int) -> int:
    debounce, scans = DEBOUNCES[name]
    raster, adaptive = skins_of(rows, debounce, scans)
    assert facts(raster).row_clocks == facts(adaptive).row_clocks
    hold = (4 * rows + (scans + bool(scans)) * rows + 4) * facts(raster).row_clocks + offset
    walk = every_transition(1 << rows)
    late = lateness(adaptive, walk, hold)
    worst = worst_of_raster(raster, scans)
    assert worst - 8 * facts(raster).row_clocks < late.max() <= worst
    return len(walk) - 1


@pytest.mark.slow
@pytest.mark.parametrize("name", sample(DEBOUNCES, quick=["sym_defer_pk"]))
def test_every_transition_of_4_rows_is_no_later_than_a_rasters_worst(record_property, name):
    """And the frames are the sheet's from then on. The offset moves each transition against the slots."""
    row_clocks = facts(skins_of(4, {}, 0)[0]).row_clocks
    cases = sum(check_transitions(4, name, offset) for offset in range(1, 8 * row_clocks, 13))
    record_property("cases", cases)


@pytest.mark.campaign
@pytest.mark.timeout(1200)
@pytest.mark.parametrize("offset", [7, 11])
@pytest.mark.parametrize("name", DEBOUNCES)
def test_every_transition_of_8_rows_is_no_later_than_a_rasters_worst(record_property, name, offset):
    record_property("cases", check_transitions(8, name, offset))


@pytest.mark.campaign
@pytest.mark.parametrize("name", ["none", "sym_defer_pk"])
def test_a_rasters_worst_is_what_a_raster_takes(name):
    debounce, scans = DEBOUNCES[name]
    raster, _ = skins_of(4, debounce, scans)
    known = facts(raster)
    walk = np.array([0, 1] * 20)  # from one pattern to the other, each time a clock later in the scan
    hold = (4 + scans) * known.scan_clocks + 1
    late = lateness(raster, walk, hold)
    assert worst_of_raster(raster, scans) - 20 <= late.max() <= worst_of_raster(raster, scans)
