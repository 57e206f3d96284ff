"""A board on the bench: common state of a bring-up's steps."""

from __future__ import annotations

import dataclasses
from typing import Protocol

from contactfpga.design.circuit import Circuit
from contactfpga.design.circuit.fitted import PROBABILITY, FittedCircuit
from contactfpga.driver.board import Board
from contactfpga.driver.health import Finding
from contactfpga.instruments.settling import Settling
from contactfpga.skin import Skin


class Person(Protocol):
    """The person or hand that touches the sheet."""

    stuck_s: float
    """Time for which a switch must stay pressed, while others change, to count as stuck."""

    rest_s: float
    """Time without news after which a complete step ends."""

    def asked(self, does: str, words: str) -> float:
        """Request an action, and return once it has begun, with its longest duration in s. ``does``: nothing, finger,
        ruler, card or plate; ``words``: the request for a person."""


@dataclasses.dataclass(frozen=True)
class Step:
    """Result of one step."""

    name: str
    findings: tuple[Finding, ...]
    measured: dict[str, float] = dataclasses.field(default_factory=dict)
    """Numbers by name, which ends in the unit."""
    stop: str = ""
    """Reason why later steps are pointless, and the remedy; "" if they are not."""

    @property
    def faults(self) -> int:
        """Number of faults found."""
        return sum(finding.verdict == "fault" for finding in self.findings)


@dataclasses.dataclass
class Bench:
    """A board on the bench with its person, and results that later steps need."""

    board: Board
    skin: Skin
    person: Person
    stated: Circuit | None = None
    """The circuit that the kit states."""
    seconds: float = 1.0
    """Time for counting frames."""
    timeout: float = 1.0
    """Timeout of each frame, in s."""
    probability: float = PROBABILITY
    """Probability that all intervals of the circuit hold."""
    images: dict[str, Settling] = dataclasses.field(default_factory=dict)
    fitted: FittedCircuit | None = None
