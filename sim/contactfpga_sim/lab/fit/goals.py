"""What a Skin has to meet, and in which words it is refused."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterator

from contactfpga_sim.lab.chart.errors import Z95, Interval
from contactfpga_sim.lab.chart.speed import Speed


@dataclasses.dataclass(frozen=True)
class Measured:
    """Of one Skin on the scenes of one source."""

    errors: dict[str, Interval]
    """By metric: of its zones against what there is."""
    speed: Speed


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

    def __post_init__(self) -> None:
        for field in dataclasses.fields(self):
            value = getattr(self, field.name)
            if value is not None and not 0 < value < math.inf:
                raise ValueError(f"the limit of {field.name} is {value}; it must be above 0")

    def check_count(self, count: int) -> None:
        """Raises ValueError where this many scenes without an error could not show that a share is below its limit."""
        for name in ("miscounted", "missed"):
            limit = getattr(self, name)
            if limit is not None and Z95**2 / (count + Z95**2) > limit:
                need = math.ceil(Z95**2 * (1 - limit) / limit)
                raise ValueError(
                    f"{count} scenes show at best that a share is below {100 * Z95**2 / (count + Z95**2):.3g} %, the "
                    f"limit of {name} is {100 * limit:.3g} %; take {need} scenes or more"
                )

    def misses(self, found: Measured, sure: bool = True) -> Iterator[tuple[float, str]]:
        """For each limit that is not met: how many times it is exceeded, and what was measured.

        ``sure``: errors are judged by the upper ends of their intervals, else by their means.
        """
        for name, words, scale, unit in _ERRORS:
            limit, error = getattr(self, name), found.errors[name]
            if limit is None:
                continue
            if math.isnan(error.mean):
                yield math.inf, "finds no contact"
                continue
            judged = error.high if sure else error.mean
            if not judged <= limit:
                what = words.format(_number(scale * error.mean) + unit)
                ends = f"{_number(scale * error.low)} to {_number(scale * error.high)}"
                doubt = ": too few scenes to tell" if error.mean <= limit else ""
                yield judged / limit, f"{what} ({ends}), limit {_number(scale * limit)}{unit}{doubt}"
        if self.latency_us is not None and not found.speed.worst_us <= self.latency_us:
            worst = found.speed.worst_us
            what = "no touch to time" if math.isnan(worst) else f"latency {worst:.0f} us at worst"
            over = math.inf if math.isnan(worst) else worst / self.latency_us
            yield over, f"{what}, limit {self.latency_us:.0f} us"

    def excess(self, found: Measured) -> float:
        """How many times the limit that is missed most is exceeded; 1 where all are met."""
        return max((over for over, _ in self.misses(found)), default=1.0)


_ERRORS = (
    ("miscounted", "miscounts {} of scenes", 100, " %"),
    ("missed", "misses {} of contacts", 100, " %"),
    ("barycenter_mm", "barycenter off by {}", 1, " mm"),
    ("area", "area off by {}", 100, " %"),
)


def _number(value: float) -> str:
    return f"{max(value, 0.0):.3g}"
