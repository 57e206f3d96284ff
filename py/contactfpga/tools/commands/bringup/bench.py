"""Common state of a bring-up's steps."""

from __future__ import annotations

import dataclasses
from typing import Protocol

from contactfpga.design.circuit import Circuit
from contactfpga.design.circuit.fit import PROBABILITY, FittedCircuit
from contactfpga.design.cover import Cover
from contactfpga.design.cover.fitted import Film
from contactfpga.driver.board import Board
from contactfpga.driver.health import Finding
from contactfpga.instruments.settling import Settling
from contactfpga.skin import Skin


class Person(Protocol):
    stuck_s: float
    """Time for which a switch stays pressed, while others change, to count as stuck."""

    rest_s: float
    """Time without news that ends a complete step."""

    def asked(self, does: str, words: str) -> float:
        """Request an action, and return its longest duration in s once it has begun. ``does``: nothing, finger, ruler,
        card, plate, or a weight with the force on each cell in N; ``words``: the request for a person.
        """


@dataclasses.dataclass(frozen=True)
class Step:
    name: str
    findings: tuple[Finding, ...]
    measured: dict[str, float] = dataclasses.field(default_factory=dict)
    """Numbers by name, which ends in the unit."""
    stop: str = ""
    """Reason why later steps are pointless, with the remedy; "" if they are not."""

    @property
    def faults(self) -> int:
        return sum(finding.verdict == "fault" for finding in self.findings)


@dataclasses.dataclass
class Bench:
    """A board on the bench with its person, and results for later steps."""

    board: Board
    skin: Skin
    person: Person
    stated: Circuit | None = None
    seconds: float = 1.0
    timeout: float = 1.0
    probability: float = PROBABILITY
    """Joint probability of the circuit's intervals."""
    images: dict[str, Settling] = dataclasses.field(default_factory=dict)
    fitted: FittedCircuit | None = None
    cover: Cover | None = None
    film: Film | None = None
    """Law of the resistive cells, once it is measured."""
