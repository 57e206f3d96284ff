"""Times that a sheet needs: each phase of the scan with its slowest pattern."""

from __future__ import annotations

import dataclasses
import functools
import math
from collections.abc import Callable, Iterable, Mapping

from contactfpga.design.circuit import patterns, phases, static
from contactfpga.design.circuit.network import Network
from contactfpga.design.circuit.phases import Levels, Phase, PhaseResult
from contactfpga.design.circuit.values import Circuit, CircuitError
from contactfpga.skin import Skin

MARGIN = 1.3
"""Ratio of recommended to computed times."""
STEP_US = 0.01


@dataclasses.dataclass(frozen=True)
class Time:
    """Duration of a phase with its slowest pattern."""

    seconds: float
    """Infinite if the phase never ends."""
    pattern: str

    def us(self, margin: float) -> float | None:
        """Recommended time in us; None if no time suffices."""
        if math.isinf(self.seconds):
            return None
        return round(max(1, math.ceil(1e6 * self.seconds * margin / STEP_US - 1e-9)) * STEP_US, 6)


@dataclasses.dataclass(frozen=True)
class Needs:
    """Needs of a sheet; volts are those of the real sheet."""

    precharge: Time
    """From columns being driven until they are charged."""
    settle: Time
    """From selecting a row until pressed columns read pressed and others released."""
    release: Time
    """From deselecting a row until columns may drive."""
    pulled_release: Time
    """From deselecting a row until pulls have lifted the columns, without precharge."""
    project: Time
    """From undriving the rows until touched ones read touched and others untouched."""
    project_columns: Time
    """From selecting all rows until touched columns read touched and others untouched."""
    pressed: static.Worst
    """A pressed column, and the pin of its row."""
    touched: static.Worst
    """A touched row in a projection, and the pin of its column."""
    unpressed_v: float
    """Level to which neighbors pull an unpressed column after a precharge."""
    unpressed_margin_v: float
    row_peak_ma: float
    """Peak current of a row's pin while lines are charged."""
    column_peak_ma: float


@functools.lru_cache(maxsize=64)
def needed(circuit: Circuit, rows: int, columns: int, diodes: str = "col2row") -> Needs:
    """Times, levels and currents of a sheet with these lines; 64x64 needs some 3 s."""
    if circuit.falling:
        raise CircuitError("there is [circuit.falling], whose columns fall through cells; these are times of switches")
    sheet = _Sheet(circuit, rows, columns, diodes)
    levels = sheet.levels
    settle, settled = sheet.worst(patterns.SETTLE, lambda network: phases.settle(network, levels))
    lowest = min(map(_lowest, settled), default=circuit.supply_v)
    dip = circuit.supply_v - lowest
    release, released = sheet.worst(patterns.RELEASE, phases.row_release)

    def precharged(network: Network) -> Phase:
        return phases.precharge(network, min(release.seconds, phases.longest_s(network)))

    precharge, charged = sheet.worst(patterns.RELEASE, precharged)
    pulled, _ = sheet.worst(patterns.RELEASE, lambda network: phases.pulled_release(network, levels, dip))
    by_row, _ = sheet.worst(patterns.PROJECT_ROWS, lambda network: phases.project_rows(network, levels))
    lifted, _ = sheet.worst(patterns.PROJECT_ROWS, lambda network: phases.project_rows(network, levels, True))
    by_column, _ = sheet.worst(patterns.PROJECT_COLUMNS, lambda network: phases.project_columns(network, levels))
    unpressed = lowest - (1 - phases.FULL) * circuit.supply_v
    return Needs(
        precharge=precharge,
        settle=settle,
        release=release,
        pulled_release=pulled,
        project=max(by_row, lifted, key=lambda time: time.seconds),
        project_columns=by_column,
        pressed=static.scan(circuit, rows, columns, diodes),
        touched=static.projection(circuit, rows, columns, diodes),
        unpressed_v=static.shown_v(circuit, diodes, unpressed),
        unpressed_margin_v=unpressed - levels.high,
        row_peak_ma=max(map(_peak_ma, [*settled, *released])),
        column_peak_ma=max(map(_peak_ma, charged)),
    )


def needed_by(skin: Skin, circuit: Circuit) -> Needs:
    """Needs of a Skin's sheet with its guard lines."""
    return needed(circuit, skin.row_lines, skin.column_lines, skin.diodes)


def recommended_us(skin: Skin, needs: Needs, margin: float = MARGIN) -> dict[str, float | None]:
    """Recommended us for each time of the Skin that its circuit limits; None if no time suffices."""
    found = {"settle_us": needs.settle.us(margin)}
    if skin.precharge_us:
        found["precharge_us"] = needs.precharge.us(margin)
    else:
        found["release_us"] = needs.pulled_release.us(margin)
    if skin.reads_rows:
        found["project_us"] = needs.project.us(margin)
    return found


def check_times(circuit: Circuit, skin: Skin) -> None:
    """Raise :class:`CircuitError` if a time of the Skin is shorter than its circuit needs with :data:`MARGIN`."""
    if circuit.falling:
        return
    wanted = recommended_us(skin, needed_by(skin, circuit))
    short = {name: us for name, us in wanted.items() if us is None or getattr(skin, name) < us}
    if not short:
        return
    given = ", ".join(f"{name} = {getattr(skin, name):g}" for name in short)
    if None in short.values():
        raise CircuitError(f"{given}: no time is enough for this circuit; `contactfpga settle` says what would help")
    needs = ", ".join(f"{name} = {us:g}" for name, us in short.items())
    raise CircuitError(f"{given}: too short for this circuit; {needs} would do, {MARGIN:g} times what it takes")


class _Sheet:
    def __init__(self, circuit: Circuit, rows: int, columns: int, diodes: str):
        self.circuit, self.levels = circuit, Levels.of(circuit, diodes)
        self.patterns: Mapping[str, object] = patterns.named(rows, columns)

    def worst(self, names: Iterable[str], phase: Callable[[Network], Phase]) -> tuple[Time, list[PhaseResult]]:
        found = {name: phases.passed(phase(Network(self.circuit, self.patterns[name]))) for name in names}  # type: ignore[arg-type]
        worst = max(found, key=lambda name: found[name].seconds)
        return Time(found[worst].seconds, worst), list(found.values())


def _lowest(passed: PhaseResult) -> float:
    network, least = passed.phase.network, passed.phase.least[: passed.phase.network.columns]
    unpressed = passed.trace.volts[:, : network.columns][:, least > -math.inf]
    return float(unpressed.min(initial=network.circuit.supply_v))


def _peak_ma(passed: PhaseResult) -> float:
    amperes = passed.phase.network.pin_amperes(passed.trace.volts[1:], passed.phase.drives[-1])
    return 1e3 * float(abs(amperes).max(initial=0.0))
