"""The task of a cover, from a TOML file: the arm, the impact, the switch, foams and limits."""

from __future__ import annotations

import dataclasses
import math
from pathlib import Path
from typing import Any

from contactfpga.design.cover.answer import LARGEST, MAX_LENGTH_M, SMALLEST, CoverError, not_negative, positive
from contactfpga.design.cover.arm import Arm
from contactfpga.design.cover.elastic import THICKNESS_RULES
from contactfpga.design.cover.foams import FOAMS, Foam, find
from contactfpga.design.cover.medium import MEDIA
from contactfpga.design.cover.point import Switch
from contactfpga.design.cover.region import Region, load_regions
from contactfpga.design.cover.sense import CONTACTS, TOLERANCE, Model
from contactfpga.inputs import tomlfile
from contactfpga.inputs.values import is_finite, shown, suggestion
from contactfpga.skin import Skin

_NEEDED = object()

LENGTHS = ("radius_m", "effective_radius_m", "pitch_m", "pitch_min_m", "thickness_m")
"""Lengths of cover and link, refused above 1 m."""

_KEYS: dict[str, dict[str, Any]] = {
    "arm": {
        "mass_kg": _NEEDED,
        "radius_m": _NEEDED,
        "com_m": _NEEDED,
        "lever_m": _NEEDED,
        "length_m": None,
        "tube": False,
        "torque_nm": 0.0,
        "gravity": False,
        "angle_rad": 0.0,
    },
    "impact": {
        "speed_m_s": _NEEDED,
        "effective_radius_m": _NEEDED,
        "poisson": 0.5,
        "time_s": _NEEDED,
        "latency_s": _NEEDED,
    },
    "reaction": {"skin": None, "other_s": 0.0, "brake_nm": 0.0},
    "switch": {"force_n": 1.0, "area_m2": 12.6e-6},
    "limits": {
        "pitch_m": _NEEDED,
        "force_n": _NEEDED,
        "thickness_m": _NEEDED,
        "pitch_min_m": None,
        "peak_n": None,
        "mass_kg_m2": None,
        "regions": None,
    },
    "cover": {"foams": None, "free": True, "plates_m": None, "rule": "hertz", "strain": None},
    "sensitivity": {"model": None, "contact": "point", "tolerance": TOLERANCE},
}


@dataclasses.dataclass(frozen=True)
class Task:
    """The task of a cover."""

    arm: Arm
    mass_kg: float
    """Mass of the link, the striking mass of (8) as printed."""
    speed_m_s: float
    """Speed of the contact point at the touch."""
    radius_m: float
    """Effective radius R*."""
    poisson: float
    time_s: float
    """tau: required duration of the compression."""
    latency_s: float
    """t0: from the touch to the reaction."""
    switch: Switch
    pitch_m: float
    """Largest pitch."""
    force_n: float
    """Force that must be felt everywhere on the sheet."""
    thickness_m: float
    """Largest thickness."""
    pitch_min_m: float | None = None
    """Smallest pitch."""
    peak_n: float | None = None
    """Largest peak force of the impact."""
    mass_kg_m2: float | None = None
    """Largest mass of the cover per area; not checked for unknown density."""
    regions: tuple[Region, ...] = ()
    """Body regions whose limits of force and pressure must be kept."""
    foams: tuple[Foam, ...] = FOAMS
    free: bool = True
    """Whether the modulus with exactly ``time_s`` is a candidate."""
    plates_m: tuple[float, ...] = ()
    """Available thicknesses; none: any."""
    rule: str = "hertz"
    """One of :data:`contactfpga.design.cover.elastic.THICKNESS_RULES`."""
    strain: float | None = None
    """Relative compression allowed for every foam; None: each foam's own."""
    model: Model | None = None
    """Model of sensitivity; None: the simplest within ``tolerance``."""
    contact: str = "point"
    """``patch``: the sheet must feel the impact's own contact; ``point``: anything."""
    tolerance: float = TOLERANCE
    """Largest relative error of the model."""
    skin: Skin = dataclasses.field(default_factory=Skin)
    """The sheet whose latency is compared."""
    other_s: float = 0.0
    """Extra time of host, controller and motor."""
    brake_nm: float = 0.0
    """Motor torque against the motion after the reaction."""

    def __post_init__(self) -> None:
        for name, unit in (("mass_kg", "kg"), ("speed_m_s", "m/s"), ("radius_m", "m"), ("time_s", "s")):
            positive(name, getattr(self, name), unit)
        for name, unit in (("latency_s", "s"), ("pitch_m", "m"), ("force_n", "N"), ("thickness_m", "m")):
            positive(name, getattr(self, name), unit)
        for name, unit in (("pitch_min_m", "m"), ("peak_n", "N"), ("mass_kg_m2", "kg/m2"), ("strain", "")):
            if getattr(self, name) is not None:
                positive(name, getattr(self, name), unit)
        for plate in self.plates_m:
            positive("plates_m", plate, "m")
        not_negative("other_s", self.other_s, "s")
        not_negative("brake_nm", self.brake_nm, "Nm")
        if self.strain is not None and self.strain > 1:
            raise CoverError(f"strain is {self.strain}; it must not be above 1")
        if self.pitch_min_m is not None and self.pitch_min_m > self.pitch_m:
            raise CoverError(f"pitch_min_m is {self.pitch_min_m}; it must not be above pitch_m, {self.pitch_m}")
        if not self.foams and not self.free:
            raise CoverError("foams is empty and free is false; there is nothing to choose from")
        for name, value, known in (
            ("rule", self.rule, tuple(THICKNESS_RULES)),
            ("contact", self.contact, CONTACTS),
            ("model", self.model.within if self.model else "bonded", MEDIA),
        ):
            if value not in known:
                raise CoverError(f"{name} is {shown(value)}; it must be one of {', '.join(known)}")

    @classmethod
    def load(cls, path: str | Path) -> Task:
        """Read a task from a TOML file; ``[[foam]]`` adds foams, ``[reaction] skin`` is a path beside the file."""
        given = tomlfile.load(path, CoverError)
        own = tuple(_foam(path, one) for one in _foams(path, given.pop("foam", [])))
        part = _read(path, given)
        foams = FOAMS + own
        if part["cover"]["foams"] is not None:
            foams = tuple(find(name, foams) for name in part["cover"]["foams"])
        arm, impact, limits, cover, sensitivity = (
            part[name] for name in ("arm", "impact", "limits", "cover", "sensitivity")
        )
        model, skin = sensitivity["model"], part["reaction"]["skin"]
        if (table := limits.pop("regions")) is not None:
            limits["regions"] = load_regions(Path(path).parent / table)
        return cls(
            arm=Arm.link(**arm),
            mass_kg=arm["mass_kg"],
            speed_m_s=impact["speed_m_s"],
            radius_m=impact["effective_radius_m"],
            poisson=impact["poisson"],
            time_s=impact["time_s"],
            latency_s=impact["latency_s"],
            switch=Switch(**part["switch"]),
            **limits,
            foams=foams,
            free=cover["free"],
            plates_m=tuple(sorted(cover["plates_m"] or ())),
            rule=cover["rule"],
            strain=cover["strain"],
            model=None if model is None else Model(model, sensitivity["contact"]),
            contact=sensitivity["contact"],
            tolerance=sensitivity["tolerance"],
            skin=Skin() if skin is None else Skin.load(Path(path).parent / skin),
            other_s=part["reaction"]["other_s"],
            brake_nm=part["reaction"]["brake_nm"],
        )


def _read(path: str | Path, given: dict[str, Any]) -> dict[str, dict[str, Any]]:
    known = [*_KEYS, "foam"]
    for name in given:
        if name not in _KEYS:
            raise CoverError(f"{path}: unknown part {shown(name)}; {suggestion(name, known)}")
    part = {}
    for name, keys in _KEYS.items():
        values = given.get(name, {})
        if not isinstance(values, dict):
            raise CoverError(f"{path}: {name} is {shown(values)}; it must be a part, [{name}]")
        for key in values:
            if key not in keys:
                raise CoverError(f"{path}: unknown key {shown(key)} in [{name}]; {suggestion(key, keys)}")
        part[name] = {key: values.get(key, default) for key, default in keys.items()}
        for key, value in part[name].items():
            if value is _NEEDED:
                raise CoverError(f"{path}: {key} is missing in [{name}]")
            _fits(path, name, key, value, keys[key])
    return part


def _fits(path: str | Path, name: str, key: str, value: Any, default: Any) -> None:
    lists: dict[str, tuple[type, ...]] = {"foams": (str,), "plates_m": (int, float)}
    words = ("skin", "model", "rule", "contact", "regions")
    if value is None:
        return
    if key in lists:
        right = isinstance(value, list) and all(isinstance(one, lists[key]) for one in value)
        wanted = "a list"
    elif key in words:
        right, wanted = isinstance(value, str), "a text"
    elif isinstance(default, bool):
        right, wanted = isinstance(value, bool), "true or false"
    else:
        right = is_finite(value) and (value == 0 or SMALLEST <= abs(value) <= LARGEST)
        wanted = f"a number, 0 or from {SMALLEST:g} to {LARGEST:g}"
    if right and key in LENGTHS and value > MAX_LENGTH_M:
        right, wanted = False, f"a length in m, at most {MAX_LENGTH_M:g}; 5 mm is 0.005"
    if not right:
        raise CoverError(f"{path}: {key} in [{name}] is {shown(value)}; it must be {wanted}")


def _foams(path: str | Path, values: Any) -> list[dict[str, Any]]:
    if not isinstance(values, list) or not all(isinstance(one, dict) for one in values):
        raise CoverError(f"{path}: foam is {shown(values)}; it must be a part, [[foam]]")
    return values


def _foam(path: str | Path, values: dict[str, Any]) -> Foam:
    known = [field.name for field in dataclasses.fields(Foam)]
    for key in values:
        if key not in known:
            raise CoverError(f"{path}: unknown key {shown(key)} in [[foam]]; {suggestion(key, known)}")
    for key in ("name", "modulus_pa", "source"):
        if key not in values:
            raise CoverError(f"{path}: {key} is missing in [[foam]]")
    return Foam(**values)


FIRST_DESIGN = Task(
    arm=Arm.link(0.6, 0.038, 0.15, 0.2),
    mass_kg=0.6,
    speed_m_s=0.4,
    radius_m=0.019,
    poisson=0.5,
    time_s=0.008,
    latency_s=0.006,
    switch=Switch(),
    pitch_m=0.01,
    force_n=15.0,
    thickness_m=0.01,
    foams=(find("paper"),),
    brake_nm=3.0,
)
"""The first design of the paper's Section IV."""
WORST_M = 5e-3 * math.sqrt(2)
"""The farthest place from a switch on the paper's sheet."""
