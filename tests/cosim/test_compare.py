"""The lockstep comparison finds and names every planted fault; the switch matrix does what a sheet does."""

import dataclasses

import numpy as np
import pytest

from contactfpga.skin import Skin
from contactfpga_sim.model.golden import Timeline, Trace, boundaries, predict
from contactfpga_sim.model.sheet.matrix import Matrix
from contactfpga_sim.verify.cosim.compare import Mismatch, compare

SKIN = Skin(rows=4, columns=6, report="barycenter")
BOUNDARIES = boundaries(SKIN)


@pytest.fixture(scope="module")
def predicted() -> Trace:
    rng = np.random.default_rng(3)
    return predict(SKIN, Timeline.frames(SKIN, rng.random((20, 4, 6)) < 0.4), 20 * 4 * 72)


def with_event(trace: Trace, boundary: str, index: int, event: tuple) -> Trace:
    events = list(trace.events(boundary))
    events[index] = event
    return dataclasses.replace(trace, **{boundary: events})


def test_equal_traces_agree(predicted):
    assert compare(predicted, predicted) == sum(len(predicted.events(name)) for name in BOUNDARIES) > 900


@pytest.mark.parametrize("boundary", BOUNDARIES)
@pytest.mark.parametrize("place", ["first", "middle", "last"])
def test_delay_of_one_clock_is_named(predicted, boundary, place):
    events = predicted.events(boundary)
    index = {"first": 0, "middle": len(events) // 2, "last": len(events) - 1}[place]
    cycle, *payload = events[index]
    with pytest.raises(Mismatch) as found:
        compare(predicted, with_event(predicted, boundary, index, (cycle + 1, *payload)))
    fault = found.value
    assert (fault.boundary, fault.cycle, fault.expected, fault.got) == (boundary, cycle, tuple(payload), None)
    assert str(cycle) in str(fault)
    assert boundary in str(fault)


@pytest.mark.parametrize("boundary", BOUNDARIES)
@pytest.mark.parametrize("bit", [0, 1, 5])
def test_error_of_one_bit_is_named(predicted, boundary, bit):
    events = predicted.events(boundary)
    index = len(events) // 3
    cycle, value, *rest = events[index]
    wrong = value ^ (1 << (0 if boundary in ("line", "contact") else bit))
    with pytest.raises(Mismatch) as found:
        compare(predicted, with_event(predicted, boundary, index, (cycle, wrong, *rest)))
    fault = found.value
    assert (fault.boundary, fault.cycle) == (boundary, cycle)
    assert (fault.expected, fault.got) == ((value, *rest), (wrong, *rest))


@pytest.mark.parametrize("boundary", ["rows", "records", "items"])
def test_wrong_mark_of_the_last_item_is_named(predicted, boundary):
    cycle, value, mark = predicted.events(boundary)[2]
    with pytest.raises(Mismatch) as found:
        compare(predicted, with_event(predicted, boundary, 2, (cycle, value, not mark)))
    assert (found.value.boundary, found.value.cycle) == (boundary, cycle)


def test_missing_and_extra_events_are_named(predicted):
    short = dataclasses.replace(predicted, bytes=predicted.bytes[:-1])
    cycle, value = predicted.bytes[-1]
    with pytest.raises(Mismatch) as found:
        compare(predicted, short)
    assert (found.value.cycle, found.value.expected, found.value.got) == (cycle, (value,), None)
    with pytest.raises(Mismatch) as found:
        compare(short, predicted)
    assert (found.value.cycle, found.value.expected, found.value.got) == (cycle, None, (value,))


def test_earliest_cycle_wins_and_then_the_boundary_passed_first(predicted):
    row, byte = predicted.rows[-1], predicted.bytes[0]
    both = with_event(with_event(predicted, "rows", -1, (row[0], row[1] ^ 1, row[2])), "bytes", 0, (byte[0], 0xFF))
    with pytest.raises(Mismatch) as found:
        compare(predicted, both)
    assert found.value.boundary == "bytes"
    cycle = predicted.rows[0][0]
    same = dataclasses.replace(predicted, bytes=[(cycle, 1), *predicted.bytes[1:]], rows=[(cycle, 1, True)])
    with pytest.raises(Mismatch) as found:
        compare(dataclasses.replace(same, bytes=[(cycle, 2)], rows=[(cycle, 2, True)]), same)
    assert found.value.boundary == "rows"


def test_only_cycles_of_both_traces_are_compared(predicted):
    half = predicted.until(predicted.cycles // 2)
    assert compare(half, predicted) == compare(predicted, half) == compare(half, half)


@pytest.mark.parametrize(("diodes", "idle", "driven"), [("col2row", 0b111, 0b101), ("row2col", 0b000, 0b010)])
def test_matrix_passes_the_driven_rows_level_to_its_columns(diodes, idle, driven):
    sheet = Matrix(Skin(rows=3, columns=5, diodes=diodes))
    cells = np.zeros((3, 5), bool)
    cells[1, [0, 3]] = cells[2, 4] = True
    rest = 0b11111 if diodes == "col2row" else 0
    assert sheet.levels(driven) == rest
    sheet.press(cells)
    assert sheet.levels(driven) ^ rest == 0b01001
    assert sheet.levels(idle) == rest
    sheet.press(cells, np.array([False, True, False, False, False]))
    assert sheet.levels(driven) ^ rest == 0b01011
    assert sheet.levels(idle) ^ rest == 0b00010


def test_matrix_joins_several_driven_rows():
    sheet = Matrix(Skin(rows=3, columns=3, diodes="row2col"))
    sheet.press([0b001, 0b010, 0b100])
    assert sheet.levels(0b101) == 0b101
