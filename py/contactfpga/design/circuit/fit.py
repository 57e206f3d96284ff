"""Values of a sheet's circuit from the times in which its cells read pressed (`contactfpga wire --settle`).

A cell's time is the model's, times a factor of its row and one of its column with a median of 1. One number of pressed
switches in a row determines the capacitance of the lines, two also the resistance of a closed switch.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Sequence

import numpy as np

from contactfpga.design.circuit import phases
from contactfpga.design.circuit.network import Network
from contactfpga.design.circuit.phases import Levels
from contactfpga.design.circuit.values import LIMITS, Circuit, CircuitError

NAMES = ("line_pf", "switch_ohm")
"""Fitted fields of :class:`Circuit`, one per informative reading."""
PROBABILITY = 0.95
LEAST_LINES = 3
ROUNDS, CLOSE, STEP = 20, 1e-3, 0.03
"""Newton's method: most rounds, relative change at its end, and relative step of the derivative."""
NEARLY = 0.02
"""Accepted relative change without convergence."""
DRAWS = 20_000
HARMONICS = 6
SCATTER = 2.0
"""Ratio of the lines' variance to that of their cells from which lines scatter."""
MOST_FREEDOM = 1e6


@dataclasses.dataclass(frozen=True, eq=False)
class SettleReading:
    """Time of each cell to read pressed, with the same number of pressed switches in all rows."""

    pressed: int
    """Pressed switches in each row that pull their column, a guard column included."""
    clocks: np.ndarray
    """(rows, columns) least clocks at which a cell reads pressed; 0: unknown."""
    first: int
    """Earliest sampling clock; a cell with this value may be faster."""


@dataclasses.dataclass(frozen=True)
class FittedValue:
    """A field of :class:`Circuit`; all intervals of a fit hold together with its probability."""

    name: str
    value: float
    low: float
    high: float

    @property
    def determined(self) -> bool:
        """Whether the readings determine the value, by an interval within a circuit's limits."""
        least, most, _ = LIMITS[self.name]
        return least < self.low and self.high < most


@dataclasses.dataclass(frozen=True)
class FittedCircuit:
    circuit: Circuit
    values: tuple[FittedValue, ...]
    rows: int
    columns: int


def settle_s(circuit: Circuit, rows: int, columns: int, diodes: str, pressed: int) -> float:
    """Seconds from selecting a row until its slowest pressed column reads pressed; infinite if never."""
    network = Network(circuit, np.tile(np.arange(columns) < pressed, (rows, 1)))
    done = phases.passed(phases.settle(network, Levels.of(circuit, diodes)))
    return float(done.phase.arrived(done.trace.seconds, done.trace.volts)[:pressed].max())


def fit_circuit(
    stated: Circuit,
    readings: Sequence[SettleReading],
    clock_hz: float,
    rows: int,
    columns: int,
    diodes: str = "col2row",
    probability: float = PROBABILITY,
) -> FittedCircuit:
    """The circuit of a sheet from one or two readings; ``rows`` and ``columns`` include guard lines.

    All intervals together cover the truth with ``probability``. Raises :class:`CircuitError` for fewer than three fully
    measured rows or columns, for cells faster than the board's first sample, or if no values fit.
    """
    readings = sorted(readings, key=lambda one: one.pressed)[: len(NAMES)]
    names = NAMES[: len({one.pressed for one in readings})]
    if not readings or len(names) < len(readings):
        raise CircuitError(f"{len(readings)} readings with {len(names)} numbers of pressed switches; they must differ")
    grid = _whole(np.all([one.clocks > 0 for one in readings], axis=0))
    clocks = [one.clocks[np.ix_(*grid)] for one in readings]
    for one, each in zip(readings, clocks, strict=True):
        if (each <= one.first).any():
            raise CircuitError(
                f"with {one.pressed} switches pressed in a row, cells read pressed at the first sample, {one.first} "
                "clocks after a row is selected: too fast for this clock"
            )
    middles = np.array([np.log(each - 0.5) + 1 / (24 * each**2) for each in clocks]) - math.log(clock_hz)
    means = middles.mean(axis=(1, 2))

    def times(values: np.ndarray) -> np.ndarray:
        circuit = stated.replace(**dict(zip(names, values.tolist(), strict=True)))
        found = [settle_s(circuit, rows, columns, diodes, one.pressed) for one in readings]
        if not all(map(math.isfinite, found)):
            raise CircuitError("the values that the times ask for would keep pressed columns from ever reading pressed")
        return np.log(found)

    values, slopes = _solved(times, np.array([getattr(stated, name) for name in names]), means, names)
    weights = np.linalg.inv(slopes)
    spread = np.array([_rounding_variance(each) for each in clocks])
    covariance, degrees = _covariance(np.tensordot(weights, middles, 1), weights**2 @ spread)
    factor = _factor(covariance, degrees, probability)
    fitted = []
    for name, value, sigma in zip(names, values, np.sqrt(np.diagonal(covariance)), strict=True):
        least, most, _ = LIMITS[name]
        low, high = max(least, value - factor * sigma), min(most, value + factor * sigma)
        fitted.append(FittedValue(name, float(value), float(low), float(high)))
    circuit = stated.replace(**{one.name: one.value for one in fitted})
    return FittedCircuit(circuit, tuple(fitted), len(grid[0]), len(grid[1]))


def _whole(known: np.ndarray) -> tuple[list[int], list[int]]:
    rows, columns = ([*range(count)] for count in known.shape)
    while rows and columns and not known[np.ix_(rows, columns)].all():
        gaps = ~known[np.ix_(rows, columns)]
        by_row, by_column = gaps.mean(axis=1), gaps.mean(axis=0)
        if by_row.max() > by_column.max():
            del rows[int(by_row.argmax())]
        else:
            del columns[int(by_column.argmax())]
    if min(len(rows), len(columns)) < LEAST_LINES:
        raise CircuitError(
            f"{len(rows)} rows and {len(columns)} columns were measured as a whole, with each number of pressed "
            f"switches; {LEAST_LINES} of each are needed"
        )
    return rows, columns


def _solved(
    times: Callable[[np.ndarray], np.ndarray], start: np.ndarray, goal: np.ndarray, names: Sequence[str]
) -> tuple[np.ndarray, np.ndarray]:
    values = start.astype(float)
    low, high = (np.array([LIMITS[name][end] for name in names], float) for end in (0, 1))
    for number in range(ROUNDS):
        now = times(values)
        slopes = np.empty((len(values), len(values)))
        for index in range(len(values)):
            moved = values.copy()
            moved[index] *= 1 + STEP
            slopes[:, index] = (times(moved) - now) / (moved[index] - values[index])
        step = np.linalg.solve(slopes, goal - now)
        wanted = np.clip(values + step, np.maximum(low, values / 4), np.minimum(high, 4 * values))
        close = CLOSE if number < ROUNDS // 2 else NEARLY
        done = bool((np.abs(wanted - values) <= close * values).all())
        values = wanted
        if done:
            break
    at_limit = [name for name, value, least, most in zip(names, values, low, high) if not least < value < most]
    if at_limit or not done:
        raise CircuitError(
            f"no {' and '.join(at_limit or names)} within its limits gives these times: another value of [circuit] is "
            "wrong, or the clock is too slow to tell"
        )
    return values, slopes


def _rounding_variance(clocks: np.ndarray) -> float:
    variance = max(0.0, float(clocks.var()) - 1 / 12)
    harmonics = np.arange(1, HARMONICS + 1)
    off = float(np.sum(np.exp(-4 * np.pi**2 * harmonics**2 * variance) / (2 * np.pi**2 * harmonics**2)))
    return off / float(clocks.mean() - 0.5) ** 2


def _mean_variance(cells: np.ndarray) -> tuple[float, float]:
    """Variance of the mean of (rows, columns) cells and its degrees of freedom (Satterthwaite)."""
    rows, columns = cells.shape
    mean = cells.mean()
    by_row, by_column = cells.mean(axis=1) - mean, cells.mean(axis=0) - mean
    rest = cells - mean - by_row[:, None] - by_column[None]
    freedom = (rows - 1) * (columns - 1)
    both = float((rest**2).sum()) / freedom / rest.size
    variance, doubt = both, both**2 / freedom
    for lines in (by_row, by_column):
        part = float((lines**2).sum()) / (len(lines) - 1) / len(lines)
        if part > SCATTER * both:
            variance += part - both
            doubt += part**2 / (len(lines) - 1)
    return variance, variance**2 / doubt if doubt else math.inf


def _covariance(cells: np.ndarray, rounding: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(n, n) covariance of the means of (n, rows, columns) cells, and (n,) degrees of freedom."""
    count = len(cells)
    covariance, degrees = np.empty((count, count)), np.empty(count)
    alone = [_mean_variance(each) for each in cells]
    for one, (variance, freedom) in enumerate(alone):
        for other in range(one):
            both = _mean_variance(cells[one] + cells[other])[0]
            limit = math.sqrt(variance * alone[other][0])
            shared = float(np.clip((both - variance - alone[other][0]) / 2, -limit, limit))
            covariance[one, other] = covariance[other, one] = shared
        covariance[one, one] = variance + rounding[one]
        degrees[one] = MOST_FREEDOM
        if variance:
            degrees[one] = min(MOST_FREEDOM, freedom * (covariance[one, one] / variance) ** 2)
    return covariance, degrees


def _factor(covariance: np.ndarray, degrees: np.ndarray, probability: float) -> float:
    rng = np.random.default_rng(0)
    sigma = np.sqrt(np.maximum(np.diagonal(covariance), 1e-300))
    correlation = covariance / np.outer(sigma, sigma)
    normal = rng.multivariate_normal(np.zeros(len(sigma)), correlation, DRAWS, method="eigh")
    scale = np.sqrt(rng.chisquare(degrees, (DRAWS, len(degrees))) / degrees)
    return float(np.quantile(np.abs(normal / scale).max(axis=1), probability))
