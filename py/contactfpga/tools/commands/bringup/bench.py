"""A board on the bench: what the steps of a bring-up share."""

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
    """Who touches the sheet."""

    stuck_s: float
    """A switch that stays pressed for so long while others come and go is stuck."""

    rest_s: float
    """Without anything new a step ends after so long, once it has what it needs."""

    def asked(self, does: str, words: str) -> float:
        """Ask for something, and return once it has begun, with the seconds that it may take at most. ``does``:
        nothing, finger, ruler, card or plate; ``words``: the same for a person."""


@dataclasses.dataclass(frozen=True)
class Step:
    """What one step showed."""

    name: str
    findings: tuple[Finding, ...]
    measured: dict[str, float] = dataclasses.field(default_factory=dict)
    """Numbers by their names, which end in their units."""
    stop: str = ""
    """Why later steps would tell nothing, and what to do; "" where they would."""

    @property
    def faults(self) -> int:
        """Findings that are faults."""
        return sum(finding.verdict == "fault" for finding in self.findings)


@dataclasses.dataclass
class Bench:
    """A board on the bench with who touches it, and what later steps need of earlier ones."""

    board: Board
    skin: Skin
    person: Person
    stated: Circuit | None = None
    """The circuit that the kit states."""
    seconds: float = 1.0
    """Over which frames are counted."""
    timeout: float = 1.0
    """Of each frame, in s."""
    probability: float = PROBABILITY
    """With which the intervals of the circuit hold, all at once."""
    images: dict[str, Settling] = dataclasses.field(default_factory=dict)
    fitted: FittedCircuit | None = None
