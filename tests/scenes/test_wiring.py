"""The wiring of a faulty sheet against nodal analysis and the circuit model; slow columns against the closed form."""

import itertools
import math

import numpy as np
import pytest
from reversal import FAST

from contactfpga.design.circuit import Circuit, phases
from contactfpga.design.circuit.network import Network
from contactfpga.design.circuit.phases import Levels
from contactfpga_sim.model.board.compiled import CompiledBoard
from contactfpga_sim.model.sheet.line import ColumnLine, RowLine, lines_of
from contactfpga_sim.model.sheet.wiring import Wiring, at_rest

SIZE = 3
PATTERNS = (np.arange(1 << SIZE * SIZE)[:, None] >> np.arange(SIZE * SIZE) & 1).astype(bool).reshape(-1, SIZE, SIZE)
VOLTS, DROP, PULL, DRIVER, SWITCH, LEAK = 3.3, 0.3, 4700.0, 40.0, 1.0, 1e9


def column_volts(pressed, bare, row, held):
    """(n, 3) volts of the columns of (n, 3, 3) patterns while a row is low: nodal analysis with diodes that
    conduct above their drop. ``held``: (3,) bool, rows that are high meanwhile; the others float."""
    count = len(pressed)
    fixed, source = np.zeros((count, 2 * SIZE)), np.zeros((count, 2 * SIZE))
    fixed[:] = 1 / LEAK
    fixed[:, row] += 1 / DRIVER
    for other in np.flatnonzero(held):
        if other != row:
            fixed[:, other] += 1 / DRIVER
            source[:, other] += VOLTS / DRIVER
    fixed[:, SIZE:] += 1 / PULL
    source[:, SIZE:] += VOLTS / PULL
    on = pressed.copy()
    for _ in range(40):
        matrix, right = np.zeros((count, 2 * SIZE, 2 * SIZE)), source.copy()
        matrix[:, range(2 * SIZE), range(2 * SIZE)] = fixed
        for r, c in itertools.product(range(SIZE), repeat=2):
            g = np.where(pressed[:, r, c] & (bare[r, c] | on[:, r, c]), 1 / SWITCH, 0.0)
            drop = 0.0 if bare[r, c] else DROP
            for a, b, sign in ((SIZE + c, r, 1), (r, SIZE + c, -1)):
                matrix[:, a, a] += g
                matrix[:, a, b] -= g
                right[:, a] += sign * g * drop
        volts = np.linalg.solve(matrix, right[..., None])[..., 0]
        forward = volts[:, None, SIZE:] - volts[:, :SIZE, None]
        wrong = np.where(pressed & ~bare, np.where(on, DROP - forward, forward - DROP), -1.0).reshape(count, -1)
        worst = wrong.argmax(axis=1)
        flips = np.flatnonzero(wrong[range(count), worst] > 1e-7)
        if not len(flips):
            return volts[:, SIZE:]
        on.reshape(count, -1)[flips, worst[flips]] ^= True
    raise AssertionError("no state of the diodes fits")


def bare_patterns():
    one = [np.eye(1, SIZE * SIZE, k).reshape(SIZE, SIZE).astype(bool) for k in range(SIZE * SIZE)]
    rng = np.random.default_rng(3)
    return [np.zeros((SIZE, SIZE), bool), np.ones((SIZE, SIZE), bool), *one, *(rng.random((14, SIZE, SIZE)) < 0.4)]


@pytest.mark.slow
@pytest.mark.parametrize("floating", [True, False])
def test_every_pattern_of_3x3_reads_as_nodal_analysis_says(floating, record_property):
    ghosts = fights = 0
    for bare in bare_patterns():
        circuit = Wiring(bare=bare, floating=floating)
        read, undefined = map(np.array, zip(*map(circuit.read, PATTERNS)))
        for row in range(SIZE):
            volts = column_volts(PATTERNS, bare, row, np.full(SIZE, not floating))
            certain = ~undefined[:, row]
            assert np.array_equal((volts < VOLTS / 2) & certain, read[:, row])
            assert ((volts < 0.3 * VOLTS) | (volts > 0.7 * VOLTS))[certain].all()
            # Two rows that meet: no level that a data sheet allows for low, nor the one of a column left alone.
            assert ((volts > 0.8) & (volts < VOLTS - 0.05))[undefined[:, row] & PATTERNS[:, row]].all()
        ghosts += int((read & ~PATTERNS).sum())
        fights += int(undefined.sum())
    assert bool(ghosts) == floating
    assert bool(fights) != floating
    record_property("cases", len(PATTERNS) * SIZE * len(bare_patterns()))


def test_with_every_diode_in_place_a_cell_reads_what_is_pressed():
    for floating, pressed in itertools.product((False, True), PATTERNS):
        read, undefined = Wiring(floating=floating).read(pressed)
        assert np.array_equal(read, pressed)
        assert not undefined.any()


def test_broken_lines_stuck_and_dead_switches():
    rng = np.random.default_rng(1)
    pressed = rng.random((200, 4, 5)) < 0.4
    dead, closed = rng.random((2, 4, 5)) < 0.2
    circuit = Wiring(dead=dead, closed=closed, broken_rows=(1,), broken_columns=(0, 3))
    for cells in pressed:
        expected = (cells | closed) & ~dead
        expected[1] = expected[:, [0, 3]] = False
        assert np.array_equal(circuit.read(cells)[0], expected)


def test_a_broken_row_of_a_bare_sheet_still_joins_its_columns():
    corners = np.zeros((3, 3), bool)
    corners[0, 0] = corners[1, 0] = corners[1, 2] = True
    read, _ = Wiring(bare=np.ones((1, 1), bool), floating=True, broken_rows=(1,)).read(corners)
    assert np.argwhere(read).tolist() == [[0, 0], [0, 2]]


def test_wiring_is_what_the_circuit_comes_to():
    """The ideal switches against the model of the circuit, of which they are the limit."""
    circuit = Circuit(column_pull_ohm=100_000.0, row_pull_ohm=1e8, switch_ohm=1.0, low_v=0.99, high_v=2.31)
    rng = np.random.default_rng(4)
    fights = 0
    for _ in range(40):
        pressed, bare = rng.random((2, SIZE, SIZE)) < 0.4
        read, undefined = Wiring(bare=bare).read(pressed)
        levels_read, levels_undefined, amperes = at_rest(circuit, pressed, bare)
        assert np.array_equal(read, levels_read & ~undefined)
        assert not (levels_undefined & ~undefined).any()
        assert (amperes > 5e-3) == bool(undefined.any())
        fights += int(undefined.any())
    assert 0 < fights < 40


AT_ONCE = ColumnLine((1e-12,) * (FAST.columns + 1), (1.0,) * (FAST.columns + 1), 1e-12, 0.5)


@pytest.mark.parametrize(("rise_clocks", "lifted"), [(0.01, 0.9), (40.0, 0.9), (300.0, 0.7), (1.0, 0.49)])
def test_a_row_that_is_let_go_rises_as_the_closed_form_says(rise_clocks, lifted):
    """The contact pin rises later by the clocks for which the row is below the threshold, or never."""
    clock_s, start = 1 / FAST.clock_hz, 20_000
    cells = np.zeros((FAST.rows, FAST.columns), bool)
    cells[5, 3] = True

    def rises(line):
        with CompiledBoard(FAST, capture=("contact",)) as board:
            board.settle(AT_ONCE, line)
            board.run(start)
            board.press(cells)
            board.run(4_000)
            return [int(cycle) - start for cycle in board.take("contact")["cycle"]]

    def line(clocks, share):
        count = FAST.column_lines + 1
        return RowLine((clocks * clock_s,) * count, (share,) * count, clock_s, 0.5)

    (at_once,) = rises(line(0.001, 1.0))
    below = math.floor(-math.log(1 - 0.5 / lifted) * rise_clocks) if lifted > 0.5 else None
    assert rises(line(rise_clocks, lifted)) == ([] if below is None else [at_once + below])


def test_a_row_rises_and_falls_when_its_circuit_does():
    """A switch lifts its row, among eight, and a row that nobody touches comes down: the times of the whole sheet."""
    circuit, touched = Circuit(switch_ohm=3000.0, line_pf=60.0), np.zeros((8, 8), bool)
    touched[2, 5] = True
    levels = Levels.of(circuit)
    line = RowLine.of(circuit, 8)
    up = -line.rise_s[1] * math.log(1 - line.threshold / line.lifted[1])
    down = line.fall_s * math.log(1 / line.threshold)
    whole = phases.project_rows(Network(circuit, touched), levels, lifted=True)
    found = phases.passed(whole)
    risen = whole.arrived(found.trace.seconds, found.trace.volts)[8 + 2]
    assert up == pytest.approx(risen, rel=0.1)
    empty = phases.passed(phases.project_rows(Network(circuit, np.zeros((8, 8), bool)), levels)).seconds
    assert down == pytest.approx(empty, rel=0.15)
    assert line.lifted[1] < line.lifted[8]
    with pytest.raises(ValueError, match="a line for 8 columns; the sheet has 16"), CompiledBoard(FAST) as board:
        board.settle(AT_ONCE, line)


@pytest.mark.parametrize("guard", [False, True])
@pytest.mark.parametrize("scan", ["raster", "reversal"])
def test_the_lines_of_a_sheet_have_its_guard_lines(guard, scan):
    skin = FAST.replace(scan=scan, guard=guard, settle_us=5.0)
    columns, rows = lines_of(Circuit(), skin)
    assert len(columns.press_s) == FAST.columns + guard + 1
    assert (rows is None) == (scan == "raster")
    assert rows is None or len(rows.rise_s) == FAST.columns + guard + 1
