"""The switch under the cover."""

from __future__ import annotations

import dataclasses

from contactfpga.design.cover.answer import positive


@dataclasses.dataclass(frozen=True)
class Switch:
    """A switch and the face on which the cover presses. The defaults are those of the paper's prototype."""

    force_n: float = 1.0
    """Force that closes it, in N."""
    area_m2: float = 12.6e-6
    """Area of its face in m2."""

    def __post_init__(self) -> None:
        positive("force_n", self.force_n, "N")
        positive("area_m2", self.area_m2, "m2")

    @property
    def closing_pa(self) -> float:
        """Normal stress in Pa at which it closes: force over area (paper, III.D)."""
        return self.force_n / self.area_m2
