"""The report of a first power-up: one Markdown file for an issue, without personal data."""

from __future__ import annotations

import dataclasses
import datetime
import platform
from collections.abc import Iterable, Mapping
from typing import Any, NamedTuple

from contactfpga import __version__
from contactfpga.design.circuit.fit import PROBABILITY, FittedCircuit, FittedValue
from contactfpga.design.cover.fitted import Film, FittedForce
from contactfpga.design.kits import Kit
from contactfpga.design.predictions import Prediction
from contactfpga.skin import Skin
from contactfpga.tools.commands.bringup.bench import Step

NOT_FITTED = (
    "[cover] is not fitted: a board does not feel forces. Lay the sheet on a kitchen scale, press a rod of 4 mm on the "
    "middle of one cap after the other, and give three or more of the forces at which they close: "
    "--measured closing_rod_n=0.42 ..."
)


class Grade(NamedTuple):
    prediction: Prediction
    measured: float
    within: float
    """Tolerance of the measurement from rounding to clocks."""

    @property
    def holds(self) -> bool:
        one = self.prediction
        return one.low - self.within <= self.measured <= one.high + self.within

    @property
    def verdict(self) -> str:
        """The verdict in words; names the wrong model."""
        return "as predicted" if self.holds else f"not as predicted: the model of the {self.prediction.model} is wrong"


def graded(predictions: Mapping[str, Prediction], measured: Mapping[str, float]) -> list[Grade]:
    """The measured predictions. A value ``NAME_step`` is the rounding step of NAME."""
    return [
        Grade(one, measured[name], measured.get(f"{name}_step", 0.0) / 2)
        for name, one in predictions.items()
        if name in measured
    ]


class BringUpReport:
    def __init__(self, kit: Kit, skin: Skin, when: datetime.date):
        self.kit, self.skin, self.when = kit, skin, when
        self.steps: list[Step] = []
        self.left_out: list[str] = []
        """Omitted steps, with reasons."""
        self.grades: list[Grade] = []
        self.not_measured: list[Prediction] = []
        self.fitted: FittedCircuit | None = None
        self.force: FittedForce | None = None
        self.film: Film | None = None

    @property
    def faults(self) -> int:
        return sum(step.faults for step in self.steps)

    def to_dict(self) -> dict[str, Any]:
        return {
            "kit": self.kit.name,
            "fingerprint": self.skin.fingerprint.hex(),
            "version": __version__,
            "date": self.when.isoformat(),
            "faults": self.faults,
            "steps": [
                {
                    "name": step.name,
                    "findings": step.findings,
                    "measured": step.measured,
                    "stop": step.stop,
                }
                for step in self.steps
            ],
            "left_out": self.left_out,
            "predictions": [
                {
                    "name": one.prediction.name,
                    "predicted": one.prediction.value,
                    "low": one.prediction.low,
                    "high": one.prediction.high,
                    "measured": one.measured,
                    "as_predicted": one.holds,
                    "model": one.prediction.model,
                }
                for one in self.grades
            ],
            "circuit": {one.name: {"value": one.value, "low": one.low, "high": one.high} for one in self._circuit()},
            "switch_force_n": None if self.force is None else dataclasses.asdict(self.force),
            "cell": [one._asdict() for one in self.film.values] if self.film else [],
        }

    def _circuit(self) -> list[FittedValue]:
        return [one for one in self.fitted.values if one.determined] if self.fitted is not None else []

    def to_markdown(self) -> str:
        parts = [f"# Bring-up of the {self.kit.name} kit, {self.when.isoformat()}\n", *self._head()]
        for step in self.steps:
            parts.append(f"\n## {step.name[0].upper()}{step.name[1:]}\n")
            parts += [f"- {finding.verdict}: {_one_line(finding.sentence)}" for finding in step.findings]
            parts += [f"\nThe bring-up stops here: {step.stop}."] if step.stop else []
        parts += ["\n## Left out\n", *(f"- {_one_line(what)}" for what in self.left_out)] if self.left_out else []
        parts += self._predictions()
        parts += self._tables()
        return "\n".join(parts) + "\n"

    def _head(self) -> Iterable[str]:
        yield f"- Skin: {self.skin.rows}x{self.skin.columns}, fingerprint `{self.skin.fingerprint.hex()}`"
        yield f"- contactfpga {__version__}, Python {platform.python_version()}, {platform.system()}"
        yield f"- faults: {self.faults}"

    def _predictions(self) -> Iterable[str]:
        if self.grades:
            yield "\n## Predictions\n"
            yield "| prediction | predicted, 95 % | measured | verdict |"
            yield "|---|---|---|---|"
            for one in self.grades:
                said = one.prediction
                interval = f"{said.value:g} ({said.low:g} to {said.high:g}) {said.unit}"
                yield f"| {said.name}: {said.what} | {interval} | {one.measured:.4g} {said.unit} | {one.verdict} |"
        if self.not_measured:
            yield f"\nNot measured: {', '.join(one.name for one in self.not_measured)}."

    def _tables(self) -> Iterable[str]:
        rows = [("circuit", one.name, one.value, one.low, one.high) for one in self._circuit()]
        if self.force is not None:
            rows.append(("cover.switch", "force_n", self.force.value, self.force.low, self.force.high))
        if self.film is not None:
            yield "\nThe CSV file beside this report has the factor of each cell's resistance."
            rows += [("cover.cell", *one) for one in self.film.values]
        if rows:
            yield f"\n## Fitted\n\nThe intervals are computed to hold together with {100 * PROBABILITY:.0f} %."
            yield "docs/bringup.md says how often they did.\n\n```toml"
            for table in dict.fromkeys(row[0] for row in rows):
                yield f"[{table}]"
                for _, name, value, low, high in (row for row in rows if row[0] == table):
                    yield f"{name} = {value:.4g}    # {low:.4g} to {high:.4g}"
            yield "```"
        if self.force is None and not self.kit.skin.ruler:
            yield f"\n{NOT_FITTED}"


def _one_line(text: str) -> str:
    return " ".join(text.split())
