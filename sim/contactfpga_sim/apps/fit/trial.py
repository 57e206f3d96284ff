"""Task, goals, trials and result of a fit."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Iterator
from concurrent.futures import Executor, Future, as_completed
from typing import Any

from contactfpga.skin import Skin
from contactfpga_sim.apps.fit.candidates import Candidate
from contactfpga_sim.apps.fit.faces import TOUCHES
from contactfpga_sim.apps.fit.sources import Source
from contactfpga_sim.apps.score import Z95, Interval
from contactfpga_sim.apps.speed import Speed


@dataclasses.dataclass(frozen=True)
class Measurement:
    errors: dict[str, Interval]
    speed: Speed | None = None
    """Speed; None if errors are too large."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class Goals:
    """Limits; None: no limit. The upper end of a mean error's 95 % interval must meet it, so that unseen scenes most
    likely agree; so must the worst measured time."""

    miscounted: float | None = 0.05
    """Share of scenes with a wrong number of zones."""
    missed: float | None = 0.05
    """Share of contacts without a zone."""
    barycenter_mm: float | None = 5.0
    """Mean distance of a zone's barycenter from its contact's."""
    area: float | None = None
    """Mean error of a zone's area over the contact's."""
    latency_us: float | None = 1000.0
    """Time from the touch to the last byte of its complete frame."""
    unfelt: float | None = 0.01
    """Share of fingertip touches that close no switch, under covers with force."""
    felt_n: float = 2.0

    def __post_init__(self) -> None:
        for field in dataclasses.fields(self):
            value = getattr(self, field.name)
            if value is not None and not 0 < value < math.inf:
                raise ValueError(f"the limit of {field.name} is {value}; it must be above 0")

    def check_count(self, count: int, feeling: bool = False) -> None:
        """Raise ValueError if this many scenes without error could not show a share below its limit; ``feeling``:
        with fingertip touches."""
        for name, each in (("miscounted", 1), ("missed", 1), ("unfelt", TOUCHES if feeling else 0)):
            limit, of = getattr(self, name), count * each
            if of and limit is not None and Z95**2 / (of + Z95**2) > limit:
                need = math.ceil(Z95**2 * (1 - limit) / limit / each)
                raise ValueError(
                    f"{count} scenes show at best that a share is below {100 * Z95**2 / (of + Z95**2):.3g} %, the "
                    f"limit of {name} is {100 * limit:.3g} %; give --placements {need} or more"
                )

    def limits(self) -> list[tuple[str, float]]:
        given = ((name, getattr(self, name)) for name, *_ in _ERRORS)
        return [(name, limit) for name, limit in given if limit is not None]

    def misses(self, found: Measurement, sure: bool = True) -> list[tuple[float, str]]:
        """Each missed limit: factor of excess, and measurement. If one is missed by the mean, those in doubt are
        omitted. ``sure``: judge errors by the upper ends of their intervals, else by the lower ones."""
        missed = list(self._missed(found, sure))
        return [one[:2] for one in missed if not one[2]] or [one[:2] for one in missed]

    def _missed(self, found: Measurement, sure: bool) -> Iterator[tuple[float, str, bool]]:
        for name, words, scale, unit in _ERRORS:
            limit, error = getattr(self, name), found.errors.get(name)
            if limit is None or error is None:
                continue
            if math.isnan(error.mean):
                yield math.inf, "finds no contact", False
                continue
            judged = error.high if sure else error.low
            if not judged <= limit:
                what = words.format(_number(scale * error.mean) + unit)
                ends = f"{_number(scale * error.low)} to {_number(scale * error.high)}"
                doubt = error.mean <= limit
                more = "; more --placements may tell" if doubt else ""
                yield judged / limit, f"{what} ({ends}), limit {_number(scale * limit)}{unit}{more}", doubt
        if found.speed and self.latency_us is not None and not found.speed.worst_us <= self.latency_us:
            worst = found.speed.worst_us
            what = "no touch to time" if math.isnan(worst) else f"latency {worst:.0f} us at worst"
            over = math.inf if math.isnan(worst) else worst / self.latency_us
            yield over, f"{what}, limit {self.latency_us:.0f} us", False

    def margin(self, found: Measurement) -> float:
        """Largest ratio of an error's upper end to its limit."""
        ends = (found.errors[name].high / limit for name, limit in self.limits() if name in found.errors)
        return max(ends, default=0.0)

    def excess(self, found: Measurement) -> float:
        return max((over for over, _ in self.misses(found)), default=1.0)


_ERRORS = (
    ("miscounted", "miscounts {} of scenes", 100, " %"),
    ("missed", "misses {} of contacts", 100, " %"),
    ("barycenter_mm", "barycenter off by {}", 1, " mm"),
    ("area", "area off by {}", 100, " %"),
    ("unfelt", "does not feel {} of fingertips", 100, " %"),
)

SHARES = ("miscounted", "missed", "unfelt")
"""Errors that are shares from 0 to 1."""


def _number(value: float) -> str:
    return f"{max(value, 0.0):.3g}"


SoFar = dict[Candidate, "Trial"]
"""Results by candidate so far, without those that Skin refuses."""

Step = Callable[[str, int], None]
"""Called after each piece with kind of work and pieces of that kind."""

TIMED = 48


@dataclasses.dataclass(frozen=True)
class FitTask:
    sources: tuple[Source, ...]
    names: tuple[str, ...]
    base: Skin
    goals: Goals
    count: int
    """Scenes of each source for the report; at most :data:`DRAWS` times as many choose."""
    host_us: float | None = None
    """Time in which the host finds the zones of a map."""
    timed: int = TIMED


@dataclasses.dataclass(frozen=True)
class Trial:
    candidate: Candidate
    measured: tuple[Measurement, ...] = ()
    refusals: tuple[str, ...] = ()
    excess: float = math.inf
    margin: float = math.inf

    @property
    def skin(self) -> Skin:
        assert self.candidate.skin is not None
        return self.candidate.skin

    @property
    def cost(self) -> tuple[int, ...]:
        return self.candidate.cost

    @property
    def bytes(self) -> float:
        """Median bytes of a frame, of the source with the longest."""
        return max((one.speed.bytes for one in self.measured if one.speed), default=math.nan)


@dataclasses.dataclass(frozen=True)
class Fit:
    task: FitTask
    answer: Trial | None
    luts: int | None
    """LUT4 of the answer."""
    cheaper: tuple[Trial, ...]
    """Refused cheaper trials, the cheapest first; without an answer, the nearest first."""
    impossible: tuple[Candidate, ...]
    reported: tuple[Measurement, ...]
    """Answer, or the nearest, by source on scenes not used to choose."""
    broken: tuple[str, ...]
    """Limits that the answer misses there."""


def gathered(
    name: str,
    jobs: dict[Any, tuple[Any, ...]],
    executor: Executor,
    step: Step,
    before: int = 0,
    found: dict[Any, Any] | None = None,
) -> dict[Any, Any]:
    """Result of each job, a function with arguments; ``before``: pieces already done; ``found`` receives each at
    once."""
    futures: dict[Future[Any], Any] = {executor.submit(*job): key for key, job in jobs.items()}
    found = {} if found is None else found
    for future in as_completed(futures):
        found[futures[future]] = future.result()
        step(name, before + len(jobs))
    return found
