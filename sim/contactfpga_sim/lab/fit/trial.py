"""What is asked, what was tried, and what came of it."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable
from concurrent.futures import Executor, Future, as_completed
from typing import Any

from contactfpga.design.cover import Cover
from contactfpga.skin import Skin
from contactfpga_sim.lab.fit.candidates import Candidate
from contactfpga_sim.lab.fit.goals import Goals, Measured
from contactfpga_sim.lab.fit.sources import Source

SoFar = dict[Candidate, "Trial"]
"""What is known of each candidate while the search goes on; all of them but those that Skin refuses."""

Step = Callable[[str, int], None]
"""Called after each piece of work with its kind, and how many pieces of that kind there are."""

TIMED = 48
"""Touches of each source whose time is worked out."""


@dataclasses.dataclass(frozen=True)
class Task:
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
    """Only those that meet the goals are synthesized; which of the refused ones are cheaper is not said."""
    timed: int = TIMED
    cover: Cover | None = None
    """Through which contacts press; for the answer's file."""


@dataclasses.dataclass(frozen=True)
class Trial:
    """A candidate with what was found."""

    candidate: Candidate
    measured: tuple[Measured, ...] = ()
    """One for each source."""
    refusals: tuple[str, ...] = ()
    excess: float = math.inf
    """How many times the limit that is missed most is exceeded."""
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
        return max((one.speed.bytes for one in self.measured), default=math.nan)

    @property
    def cost(self) -> tuple[float, ...]:
        """LUT4, then wires, then bytes."""
        return (math.inf if self.luts is None else self.luts, self.wires, self.bytes)


@dataclasses.dataclass(frozen=True)
class Fit:
    """What came of it."""

    task: Task
    answer: Trial | None
    runner_up: Trial | None
    cheaper: tuple[Trial, ...]
    """Those refused that cost less than the answer, the cheapest first; or, without an answer, the nearest first."""
    impossible: tuple[Trial, ...]
    """Those for which there is no Skin."""
    dearer: int
    """Candidates that cost more than the answer."""
    reported: tuple[tuple[Measured, ...], ...]
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
