"""A network in time, by the implicit method TR-BDF2 with error control, and its state at rest."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable

import numpy as np

from contactfpga.design.circuit.network import CircuitState, Drive, Network, charge, current, held_back
from contactfpga.design.circuit.values import CircuitError, Diode

GAMMA = 2 - math.sqrt(2)
"""Share of the first half in a step; both halves have the same equations."""
SHARE_1, SHARE_0 = 1 / (GAMMA * (2 - GAMMA)), (1 - GAMMA) ** 2 / (GAMMA * (2 - GAMMA))
ERROR = (-3 * GAMMA**2 + 4 * GAMMA - 2) / (12 * (2 - GAMMA))
FIRST_S = 1e-12
ERROR_V = 1e-3
CLOSE_V = 1e-5
"""Newton's method ends when no voltage moves by more."""
DIVERGED_V = 1e3
"""Move of a line from which Newton's method diverges."""
ROUNDS, STEPS = 60, 20_000
FOREVER_S = 1e6


@dataclasses.dataclass(frozen=True, eq=False)
class Waveform:
    """(n,) seconds from the start and (n, lines) volts."""

    seconds: np.ndarray
    volts: np.ndarray
    end: CircuitState


@dataclasses.dataclass(eq=False)
class _Rates:
    line_c: np.ndarray
    cell_c: np.ndarray
    line_a: np.ndarray
    cell_a: np.ndarray
    cell_f: np.ndarray
    cell_s: np.ndarray


def _solved(matrix: np.ndarray, right: np.ndarray, count: int) -> np.ndarray:
    """Solution of a symmetric system in two halves, to avoid slow library threads beyond 100 lines."""
    side = matrix[:count, count:]
    both = np.linalg.solve(matrix[:count, :count], np.column_stack([side, right[:count]]))
    across, alone = both[:, :-1], both[:, -1]
    rest = np.linalg.solve(matrix[count:, count:] - side.T @ across, right[count:] - side.T @ alone)
    return np.concatenate([alone - across @ rest, rest])


class _DriveEquations:
    def __init__(self, network: Network, drive: Drive):
        self.network, self.diode = network, network.circuit.diode
        siemens = network.drive_s(drive)
        self.siemens = network.siemens + np.diag(siemens + network.pull_s)
        self.source_a = siemens * np.nan_to_num(drive.volts) + network.pull_s * network.pull_v
        self.count = len(self.source_a)

    def rates(self, state: CircuitState) -> _Rates:
        net = self.network
        cell_a = (state.lines[net.column_of] - state.lines[net.row_of] - state.junctions) * net.cell_s
        junction_a, cell_s = current(self.diode, state.junctions)
        cell_c, cell_f = charge(self.diode, state.junctions)
        line_a = self.siemens @ state.lines - self.source_a + self._gathered(cell_a)
        return _Rates(net.farads @ state.lines, cell_c, line_a, junction_a - cell_a, cell_f, cell_s)

    def _gathered(self, cells: np.ndarray) -> np.ndarray:
        out = np.bincount(self.network.column_of, cells, self.count)
        return np.asarray(out - np.bincount(self.network.row_of, cells, self.count))

    def eliminated(self, rates: _Rates, share: float) -> tuple[np.ndarray, np.ndarray]:
        """Matrix of the lines alone for ``charge + share * current``, and divisor of each cell's equation."""
        net = self.network
        through = share * net.cell_s
        own = rates.cell_f + share * rates.cell_s + through
        left = through * (1 - through / own)
        matrix = net.farads + share * self.siemens
        matrix[net.column_of, net.row_of] -= left
        matrix[net.row_of, net.column_of] -= left
        sums = np.bincount(net.column_of, left, self.count) + np.bincount(net.row_of, left, self.count)
        matrix[range(self.count), range(self.count)] += sums
        return matrix, own

    def correction(self, rates: _Rates, share: float, lines: np.ndarray, cells: np.ndarray) -> CircuitState:
        net = self.network
        matrix, own = self.eliminated(rates, share)
        through = share * net.cell_s
        moved = _solved(matrix, lines + self._gathered(through * cells / own), net.columns)
        return CircuitState(moved, (cells + through * (moved[net.column_of] - moved[net.row_of])) / own)

    def solved(
        self, guess: CircuitState, share: float, lines: np.ndarray, cells: np.ndarray
    ) -> tuple[CircuitState, _Rates] | None:
        for _ in range(ROUNDS):
            rates = self.rates(guess)
            step = self.correction(
                rates,
                share,
                lines - rates.line_c - share * rates.line_a,
                cells - rates.cell_c - share * rates.cell_a,
            )
            wanted = guess.junctions + step.junctions
            junctions = held_back(self.diode, guess.junctions, wanted)
            held = bool(junctions.size) and bool((np.abs(junctions - wanted) > CLOSE_V).any())
            guess = CircuitState(guess.lines + step.lines, junctions)
            far = max(np.abs(step.lines).max(), np.abs(step.junctions).max(initial=0.0))
            if far < CLOSE_V and not held:
                return guess, self.rates(guess)
            if not np.abs(step.lines).max() < DIVERGED_V:
                return None
        return None


def at_rest(network: Network, drive: Drive) -> CircuitState:
    equations = _DriveEquations(network, drive)
    start = network.unpressed()
    rates = equations.rates(start)
    found = equations.solved(start, FOREVER_S, rates.line_c, rates.cell_c)
    if found is None:
        raise CircuitError("no state of rest was found for these values; take less extreme ones")
    return found[0]


def run(
    network: Network,
    drive: Drive,
    start: CircuitState,
    seconds: float,
    enough: Callable[[np.ndarray], bool] = lambda volts: False,
) -> Waveform:
    """Simulate the lines for this long, or until ``enough`` accepts their volts."""
    equations = _DriveEquations(network, drive)
    state, rates = start, equations.rates(start)
    times, volts, now, step = [0.0], [start.lines], 0.0, FIRST_S
    for _ in range(STEPS):
        if now >= seconds * (1 - 1e-9) or enough(state.lines):
            return Waveform(np.array(times), np.array(volts), state)
        step = min(step, seconds - now)
        middle_end = _step(equations, state, rates, step)
        if middle_end is None:
            step /= 8
            continue
        (middle, _), (end, end_rates), error = middle_end
        if error > ERROR_V:
            step *= max(0.2, 0.9 * (ERROR_V / error) ** (1 / 3))
            continue
        times += [now + GAMMA * step, now + step]
        volts += [middle.lines, end.lines]
        now, state, rates = now + step, end, end_rates
        step *= min(3.0, 0.9 * (ERROR_V / max(error, 1e-12)) ** (1 / 3))
    raise CircuitError(f"these values take more than {STEPS} steps to compute; take less extreme ones")


def _ahead(diode: Diode, start: CircuitState, middle: CircuitState) -> CircuitState:
    on = (1 - GAMMA) / GAMMA
    junctions = middle.junctions + on * (middle.junctions - start.junctions)
    lines = middle.lines + on * (middle.lines - start.lines)
    return CircuitState(lines, held_back(diode, middle.junctions, junctions))


def _step(
    equations: _DriveEquations, state: CircuitState, rates: _Rates, step: float
) -> tuple[tuple[CircuitState, _Rates], tuple[CircuitState, _Rates], float] | None:
    share = GAMMA * step / 2
    middle = equations.solved(state, share, rates.line_c - share * rates.line_a, rates.cell_c - share * rates.cell_a)
    if middle is None:
        return None
    half = middle[1]
    end = equations.solved(
        _ahead(equations.diode, state, middle[0]),
        share,
        SHARE_1 * half.line_c - SHARE_0 * rates.line_c,
        SHARE_1 * half.cell_c - SHARE_0 * rates.cell_c,
    )
    if end is None:
        return None
    last = end[1]
    parts = [
        2 * ERROR * step * (before / GAMMA - between / (GAMMA * (1 - GAMMA)) + after / (1 - GAMMA))
        for before, between, after in (
            (rates.line_a, half.line_a, last.line_a),
            (rates.cell_a, half.cell_a, last.cell_a),
        )
    ]
    error = equations.correction(last, share, *parts)
    return middle, end, float(np.abs(error.lines).max())
