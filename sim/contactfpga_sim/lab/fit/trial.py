"""What is asked, what a Skin has to meet, what was tried, and what came of it."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Iterator
from concurrent.futures import Executor, Future, as_completed
from typing import Any

from contactfpga.skin import Skin
from contactfpga_sim.lab.chart.errors import Z95, Interval
from contactfpga_sim.lab.chart.speed import Speed
from contactfpga_sim.lab.fit.candidates import Candidate
from contactfpga_sim.lab.fit.faces import TOUCHES
from contactfpga_sim.lab.fit.sources import Source


@dataclasses.dataclass(frozen=True)
class Measurement:
    """Of one Skin on the scenes of one source."""

    errors: dict[str, Interval]
    """By metric: of its zones against what there is."""
    speed: Speed | None = None
    """None where it was not looked at, because errors are too large."""


DOUBT = ": too few scenes to tell"


@dataclasses.dataclass(frozen=True, kw_only=True)
class Goals:
    """Limits; None: none. A mean error meets its limit when the upper end of its 95 % interval does, so that scenes
    that were not looked at will most likely not break it; a time does when the worst that was measured does."""

    miscounted: float | None = 0.05
    """Share of scenes with another number of zones than of contacts."""
    missed: float | None = 0.05
    """Share of contacts without a zone."""
    barycenter_mm: float | None = 5.0
    """Mean distance of a zone's barycenter from its contact's."""
    area: float | None = None
    """Mean of a zone's error in area over the contact's area."""
    latency_us: float | None = 1000.0
    """From the touch to the last byte of the frame that holds all of it."""
    unfelt: float | None = 0.01
    """Share of touches of a fingertip that close no switch; of covers that go by force."""
    felt_n: float = 2.0
    """Force in N with which it touches."""

    def __post_init__(self) -> None:
        for field in dataclasses.fields(self):
            value = getattr(self, field.name)
            if value is not None and not 0 < value < math.inf:
                raise ValueError(f"the limit of {field.name} is {value}; it must be above 0")

    def check_count(self, count: int, feeling: bool = False) -> None:
        """Raises ValueError where this many scenes without an error could not show that a share is below its limit;
        ``feeling``: fingertips touch, too."""
        for name, each in (("miscounted", 1), ("missed", 1), ("unfelt", TOUCHES if feeling else 0)):
            limit, of = getattr(self, name), count * each
            if of and limit is not None and Z95**2 / (of + Z95**2) > limit:
                need = math.ceil(Z95**2 * (1 - limit) / limit / each)
                raise ValueError(
                    f"{count} scenes show at best that a share is below {100 * Z95**2 / (of + Z95**2):.3g} %, the "
                    f"limit of {name} is {100 * limit:.3g} %; take {need} scenes or more"
                )

    def limits(self) -> list[tuple[str, float]]:
        """Limits of errors, by metric."""
        given = ((name, getattr(self, name)) for name, *_ in _ERRORS)
        return [(name, limit) for name, limit in given if limit is not None]

    def misses(self, found: Measurement, sure: bool = True) -> list[tuple[float, str]]:
        """For each limit that is not met: how many times it is exceeded, and what was measured. Where one is surely
        missed, those that too few scenes leave open are left out: a Skin that is dropped early was looked at on few.

        ``sure``: errors are judged by the upper ends of their intervals, else by their means.
        """
        missed = list(self._missed(found, sure))
        beyond = [one for one in missed if not one[1].endswith(DOUBT)]
        return beyond or missed

    def _missed(self, found: Measurement, sure: bool) -> Iterator[tuple[float, str]]:
        for name, words, scale, unit in _ERRORS:
            limit, error = getattr(self, name), found.errors.get(name)
            if limit is None or error is None:
                continue
            if math.isnan(error.mean):
                yield math.inf, "finds no contact"
                continue
            judged = error.high if sure else error.mean
            if not judged <= limit:
                what = words.format(_number(scale * error.mean) + unit)
                ends = f"{_number(scale * error.low)} to {_number(scale * error.high)}"
                doubt = DOUBT if error.mean <= limit else ""
                yield judged / limit, f"{what} ({ends}), limit {_number(scale * limit)}{unit}{doubt}"
        if found.speed and self.latency_us is not None and not found.speed.worst_us <= self.latency_us:
            worst = found.speed.worst_us
            what = "no touch to time" if math.isnan(worst) else f"latency {worst:.0f} us at worst"
            over = math.inf if math.isnan(worst) else worst / self.latency_us
            yield over, f"{what}, limit {self.latency_us:.0f} us"

    def margin(self, found: Measurement) -> float:
        """The greatest upper end of an error as a share of its limit."""
        ends = (found.errors[name].high / limit for name, limit in self.limits() if name in found.errors)
        return max(ends, default=0.0)

    def excess(self, found: Measurement) -> float:
        """How many times the limit that is missed most is exceeded; 1 where all are met."""
        return max((over for over, _ in self.misses(found)), default=1.0)


_ERRORS = (
    ("miscounted", "miscounts {} of scenes", 100, " %"),
    ("missed", "misses {} of contacts", 100, " %"),
    ("barycenter_mm", "barycenter off by {}", 1, " mm"),
    ("area", "area off by {}", 100, " %"),
    ("unfelt", "does not feel {} of fingertips", 100, " %"),
)

SHARES = ("miscounted", "missed", "unfelt")
"""Errors that lie between 0 and 1."""


def _number(value: float) -> str:
    return f"{max(value, 0.0):.3g}"


SoFar = dict[Candidate, "Trial"]
"""What is known of each candidate while the search goes on; all of them but those that Skin refuses."""

Step = Callable[[str, int], None]
"""Called after each piece of work with its kind, and how many pieces of that kind there are."""

TIMED = 48
"""Touches of each source whose time is worked out."""


@dataclasses.dataclass(frozen=True)
class FitTask:
    """What is asked."""

    sources: tuple[Source, ...]
    names: tuple[str, ...]
    """Of the sources, to be shown."""
    base: Skin
    goals: Goals
    count: int
    """Scenes of each source to choose with; as many others are reported."""
    host_us: float | None = None
    """How long the host takes to find zones in a bitmap; None: it does not."""
    quick: bool = False
    """Only those that meet the goals are synthesized; which of the refused ones with as many wires are cheaper is not
    said."""
    timed: int = TIMED


@dataclasses.dataclass(frozen=True)
class Trial:
    """A candidate with what was found."""

    candidate: Candidate
    measured: tuple[Measurement, ...] = ()
    """One for each source."""
    refusals: tuple[str, ...] = ()
    excess: float = math.inf
    """How many times the limit that is missed most is exceeded."""
    margin: float = math.inf
    """The greatest upper end of an error as a share of its limit."""
    luts: int | None = None
    """On the :data:`contactfpga_sim.lab.fit.cost.DEVICE`; None where it was not worked out."""

    @property
    def skin(self) -> Skin:
        """The Skin that was tried."""
        assert self.candidate.skin is not None
        return self.candidate.skin

    @property
    def wires(self) -> int:
        """Lines of the sheet."""
        return self.skin.rows + self.skin.columns

    @property
    def bytes(self) -> float:
        """Median of a frame's bytes, of the source with the longest frames."""
        return max((one.speed.bytes for one in self.measured if one.speed), default=math.nan)

    @property
    def cost(self) -> tuple[float, ...]:
        """Wires, then LUT4, then bytes, then how close errors come to their limits."""
        return (self.wires, math.inf if self.luts is None else self.luts, self.bytes, self.margin)


@dataclasses.dataclass(frozen=True)
class Fit:
    """What came of it."""

    task: FitTask
    answer: Trial | None
    runner_up: Trial | None
    cheaper: tuple[Trial, ...]
    """Those refused that cost less than the answer, the cheapest first; or, without an answer, the nearest first."""
    impossible: tuple[Trial, ...]
    """Those for which there is no Skin."""
    dearer: int
    """Candidates that cost more than the answer."""
    reported: tuple[tuple[Measurement, ...], ...]
    """Of the answer and the runner-up, or of the nearest: measured on scenes that were not used to choose."""
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
    """What each job, a function with its arguments, gives; ``before``: pieces of this kind that are done already;
    ``found``: where it is put as soon as it is there."""
    futures: dict[Future[Any], Any] = {executor.submit(*job): key for key, job in jobs.items()}
    found = {} if found is None else found
    for future in as_completed(futures):
        found[futures[future]] = future.result()
        step(name, before + len(jobs))
    return found
