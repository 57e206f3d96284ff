"""Parameters of a run, read from a TOML file."""

from __future__ import annotations

import dataclasses
import functools
from pathlib import Path
from typing import Any

from contactfpga.design.cover import BODIES, Ball, Bed, Cap, Cover, Indenter, elastic
from contactfpga.design.cover.region import Pressing
from contactfpga.errors import ContactFPGAError
from contactfpga.inputs import tomlfile
from contactfpga.inputs.values import shown
from contactfpga.skin import Skin
from contactfpga_sim.lab.arm.parts import (
    ArmLink,
    Contacts,
    Control,
    Foam,
    Motor,
    Run,
    Touch,
    Usb,
)

_CASES = Path(__file__).parent / "cases"
MODELS = ("point", "foam")
MAX_STEPS = 1_000_000
STEPS_A_TIME_CONSTANT = 4
"""Least steps in the time constant of the current, the plant's shortest."""


class CaseError(ContactFPGAError, ValueError):
    """An impossible case; the message names field, value and limit."""


@dataclasses.dataclass(frozen=True)
class Case:
    """A run of the arm. Raises :class:`CaseError`, or :class:`contactfpga.cover.CoverError` for a single number."""

    link: ArmLink
    motor: Motor
    control: Control
    foam: Foam
    switch: Contacts
    touch: tuple[Touch, ...] = (Touch(),)
    usb: Usb = dataclasses.field(default_factory=Usb)
    run: Run = dataclasses.field(default_factory=Run)
    model: str = "point"
    """``point``: the paper's half-space and point force. ``foam``: body, foam and switches as layers, see
    :mod:`contactfpga.design.cover.layers`."""
    body: str = "rigid"
    """What the arm runs into, of :data:`contactfpga.design.cover.BODIES`; for ``foam``."""
    cap: Cap | None = None
    """Cap on each switch; None: the foam presses the switches' flush faces."""
    bed: Bed | None = None
    """Pads of foam below the sheet's board; None: the board is fixed to the arm."""

    def __post_init__(self) -> None:
        _one_of("model", self.model, MODELS)
        _one_of("body", self.body, tuple(BODIES))
        if self.model == "point" and self.body != "rigid":
            raise CaseError(f"body is {shown(self.body)}; the model 'point' knows rigid ones alone, take 'foam'")
        _ = self.cover  # refuses what no cover can be
        if not self.touch:
            raise CaseError("touch is empty; the arm must run into at least one thing")
        if self.bed and len(self.touch) > 1:
            raise CaseError(f"touch has {len(self.touch)} things; a board on a bed does not tilt, so give one")
        if self.control.sensor_nm < self.control.torque_limit_nm:
            raise CaseError(
                f"torque_limit_nm is {self.control.torque_limit_nm}; the sensor reads {self.control.sensor_nm} Nm at "
                "most and would never see it"
            )
        limit = self.motor.time_constant_s / STEPS_A_TIME_CONSTANT
        if self.run.step_s > limit * (1 + 1e-9):
            raise CaseError(
                f"step_s is {self.run.step_s:g}; it must be at most {limit:g} s, a quarter of what the current takes"
            )
        if (steps := (self.run.lead_s + self.run.duration_s) / self.run.step_s) > MAX_STEPS:
            raise CaseError(f"lead_s + duration_s is {steps:.3g} times step_s; it must be at most {MAX_STEPS:,} times")
        part = self.run.step_s
        for name, whole in (("period_s", self.control.period_s), ("lead_s", self.run.lead_s)):
            if abs(whole / part - round(whole / part)) > 1e-6 or round(whole / part) < 1:
                raise CaseError(f"{name} is {whole:g}; it must be a whole number of times {part:g} s")

    @functools.cached_property
    def cover(self) -> Cover:
        foam = self.foam
        known = {"cap": self.cap, "bed": self.bed, "cut": foam.cut, "modulus_pa": foam.modulus_pa}
        return Cover(self.model, foam.thickness_m, self.switch.switch, **known)  # type: ignore[arg-type]

    def spring(self, skin: Skin) -> Indenter:
        """The cover between the arm and what it runs into."""
        if self.model == "point":
            return self.foam.half_space
        body = BODIES[self.body]
        pitches = 1e-3 * skin.pitch_x_mm, 1e-3 * skin.pitch_y_mm
        return self.cover.indentation([body.ball(self.foam.radius_m)], body, *pitches)

    @property
    def pressing(self) -> Pressing:
        """The arm on a body region: driven within the torque limit, then braked with full current."""
        link, motor, foam = self.link, self.motor, self.foam
        ball = Ball(foam.radius_m, elastic.effective_modulus_pa(foam.modulus_pa, foam.poisson))
        mass = (link.inertia_kgm2 + motor.inertia_kgm2) / link.lever_m**2
        brake = motor.current_a * motor.torque_nm_a / link.lever_m
        return Pressing(mass, self.control.torque_limit_nm / link.lever_m, brake, ball, foam.thickness_m)

    def but(self, **changes: Any) -> Case:
        """A copy with other values: ``case.but(link={"speed_m_s": 0.4}, touch=({"x_mm": 85.0},))``."""
        new: dict[str, Any] = {}
        for name, change in changes.items():
            old = getattr(self, name)
            if name == "touch":
                change = tuple(one if isinstance(one, Touch) else dataclasses.replace(old[0], **one) for one in change)
            if isinstance(change, dict):
                change = _PARTS[name](**change) if old is None else dataclasses.replace(old, **change)
            new[name] = change
        return dataclasses.replace(self, **new)

    def wearing(self, cover: Cover | None) -> Case:
        """A copy whose arm has this cover; None: the same."""
        if cover is None:
            return self
        foam = {name: getattr(cover, name) for name in ("thickness_m", "modulus_pa", "cut")}
        return self.but(
            model=cover.model, cap=cover.cap, bed=cover.bed, foam=foam, switch=dataclasses.asdict(cover.switch)
        )

    @classmethod
    def load(cls, name: str | Path) -> Case:
        """Load a packaged case by name, or a TOML file; its ``like`` names the case it differs from."""
        return _case(str(name), _values(str(name)))


_PARTS = {
    "link": ArmLink,
    "motor": Motor,
    "control": Control,
    "foam": Foam,
    "switch": Contacts,
    "cap": Cap,
    "bed": Bed,
    "usb": Usb,
    "run": Run,
}
_NAMES = ("model", "body")


def names() -> list[str]:
    return sorted(path.stem for path in _CASES.glob("*.toml"))


def _values(name: str, before: tuple[str, ...] = ()) -> dict[str, Any]:
    path = Path(name) if name.endswith(".toml") else _CASES / f"{name}.toml"
    if not path.exists():
        raise CaseError(f"case {shown(name)} is not known; take a .toml file or one of {', '.join(names())}")
    values = tomlfile.load(path, CaseError)
    if (like := values.pop("like", None)) is None:
        return values
    above = (*before, name)
    if not isinstance(like, str) or like in above:
        raise CaseError(f"{name}: like is {shown(like)}; it must name another case than {', '.join(above)}")
    merged = _values(like, above)
    for part, change in values.items():
        both = isinstance(change, dict) and isinstance(merged.get(part), dict)
        merged[part] = {**merged[part], **change} if both else change
    return merged


def _case(name: str, values: dict[str, Any]) -> Case:
    known = (*_PARTS, "touch", *_NAMES)
    if unknown := sorted(set(values) - set(known)):
        raise CaseError(f"{name}: unknown part {shown(unknown[0])}; known are {', '.join(known)}")
    parts: dict[str, Any] = {
        part: _part(name, part, kind, values[part]) for part, kind in _PARTS.items() if part in values
    }
    if "touch" in values:
        if not isinstance(values["touch"], list):
            raise CaseError(f"{name}: touch is {shown(values['touch'])}; it must be a part, [[touch]]")
        parts["touch"] = tuple(_part(name, "touch", Touch, one) for one in values["touch"])
    parts |= {word: values[word] for word in _NAMES if word in values}
    missing = [part for part in ("link", "motor", "control", "foam", "switch") if part not in parts]
    if missing:
        raise CaseError(f"{name}: the part [{missing[0]}] is missing; a case may begin with like = 'paper'")
    return Case(**parts)


def _part(name: str, part: str, kind: type, values: Any) -> Any:
    if not isinstance(values, dict):
        raise CaseError(f"{name}: {part} is {shown(values)}; it must be a part, [{part}]")
    known = [field.name for field in dataclasses.fields(kind)]
    for key in values:
        if key not in known:
            raise CaseError(f"{name}: unknown key {shown(key)} in [{part}]; known are {', '.join(known)}")
    try:
        return kind(**values)
    except TypeError as error:
        raise CaseError(f"{name}: [{part}]: {error}") from None


def _one_of(name: str, value: str, known: tuple[str, ...]) -> None:
    if value not in known:
        raise CaseError(f"{name} is {shown(value)}; it must be one of {', '.join(known)}")
