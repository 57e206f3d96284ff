"""Sources of scenes, one scene per number.

Scenes depend on the source's content and the number, not on name or order. Numbers below a count are for choosing,
later ones for the report.
"""

from __future__ import annotations

import abc
import dataclasses
import functools
import hashlib
from collections.abc import Sequence

import numpy as np

from contactfpga.design.cover import Cover
from contactfpga.inputs.files import open_regular
from contactfpga.skin import Skin
from contactfpga_sim.apps import errors
from contactfpga_sim.apps.errors import Blob, look
from contactfpga_sim.apps.light import Sensed
from contactfpga_sim.model.scenes.contacts import Contact, Value
from contactfpga_sim.model.scenes.families import FAMILIES, placements
from contactfpga_sim.model.scenes.file import SceneFile, scene_of
from contactfpga_sim.model.scenes.recordings import Recording
from contactfpga_sim.model.scenes.scene import CONTACTS, Scene

SHIFT_MM = 10.0
"""Largest shift of a built-in scene along an axis."""

SECONDS = 1.0
"""Built-in scenes are sampled within this time."""

COUNT = 500

DRAWS = 8
"""Most scenes to choose with, as a multiple of those for the report."""

Look = tuple[np.ndarray | Sensed, list[Blob]]
"""(rows, columns) bool pressed cells or, of light cells, the forces as they are read; and true contacts."""

Size = tuple[float, float]


@dataclasses.dataclass(frozen=True)
class Source(abc.ABC):
    """Scenes to choose a Skin with, and others to report."""

    def size_mm(self) -> Size | None:
        return None

    def most(self, count: int) -> int:
        """Available choosing scenes, if the report has ``count``. Later numbers are for the report."""
        return DRAWS * count

    @abc.abstractmethod
    def looks(
        self, skin: Skin, base: Skin, numbers: Sequence[int], count: int, cover: Cover | None = None
    ) -> list[Look]:
        """Scenes with these numbers on a sheet under a cover. ``base``: the requested Skin; ``count``: :meth:`most`."""


@dataclasses.dataclass(frozen=True)
class SceneSource(Source):
    @abc.abstractmethod
    def at(self, skin: Skin, base: Skin, number: int) -> tuple[Scene, float]:
        """A scene, and its sampling instant in s."""

    def looks(
        self, skin: Skin, base: Skin, numbers: Sequence[int], count: int, cover: Cover | None = None
    ) -> list[Look]:
        return [_look(number, *self.at(skin, base, number), skin, cover) for number in numbers]


def _look(number: int, scene: Scene, seconds: float, skin: Skin, cover: Cover | None) -> Look:
    if cover is None or cover.cell is None:
        return look(scene, seconds, skin, cover)
    on = scene.on_cover(skin, cover)
    return Sensed(on.forces_n(seconds, skin, cover), scene.drawn, number), errors.contacts(on.truth(seconds, skin))


@dataclasses.dataclass(frozen=True)
class Family(SceneSource):
    """One of :data:`contactfpga_sim.model.scenes.families.FAMILIES`."""

    family: str
    seed: int = 0

    def at(self, skin: Skin, base: Skin, number: int) -> tuple[Scene, float]:
        return placements(self.family, 1, self.seed, skin, first=number)[0], 0.0


@dataclasses.dataclass(frozen=True)
class BuiltIn(SceneSource):
    """One of :data:`contactfpga_sim.model.scenes.scene.CONTACTS`, made for the requested Skin."""

    scene: str
    seed: int = 0

    def at(self, skin: Skin, base: Skin, number: int) -> tuple[Scene, float]:
        rng = np.random.default_rng([self.seed, number])
        by_x, by_y = rng.uniform(-SHIFT_MM, SHIFT_MM, 2)
        # Both sheets begin half a pitch before their first switch.
        by_x += (base.pitch_x_mm - skin.pitch_x_mm) / 2
        by_y += (base.pitch_y_mm - skin.pitch_y_mm) / 2
        moved = (_moved(contact, float(by_x), float(by_y)) for contact in CONTACTS[self.scene](base).contacts)
        return Scene(tuple(moved)), float(rng.uniform(0, SECONDS))


@dataclasses.dataclass(frozen=True)
class Offset:
    value: Value
    by: float

    def __call__(self, seconds: float) -> float:
        return self.by + (self.value(seconds) if callable(self.value) else self.value)


def _moved(contact: Contact, by_x: float, by_y: float) -> Contact:
    return dataclasses.replace(contact, x_mm=Offset(contact.x_mm, by_x), y_mm=Offset(contact.y_mm, by_y))


@dataclasses.dataclass(frozen=True)
class File(SceneSource):
    says: SceneFile

    def size_mm(self) -> Size | None:
        width, height = self.says.width_mm, self.says.height_mm
        return None if width is None or height is None else (width, height)

    def at(self, skin: Skin, base: Skin, number: int) -> tuple[Scene, float]:
        return scene_of(self.says, number, skin)


@dataclasses.dataclass(frozen=True)
class RecordingSource(Source):
    """A recording of one sheet's cells; the truth is their connected pieces by the requested Skin's connectivity.
    Choosing scenes are from the first half, report scenes from the second."""

    path: str
    digest: str
    threshold: float | None = None

    @property
    def recording(self) -> Recording:
        return _recording(self.path, self.digest, self.threshold)

    def size_mm(self) -> Size | None:
        _, rows, columns = self.recording.pressed.shape
        pitch = self.recording.pitch_mm or Skin().pitch_x_mm
        return columns * pitch, rows * pitch

    def most(self, count: int) -> int:
        return min(count, len(self.recording.pressed) // 2)

    def looks(
        self, skin: Skin, base: Skin, numbers: Sequence[int], count: int, cover: Cover | None = None
    ) -> list[Look]:
        judge, frames = skin.replace(connectivity=base.connectivity), self.recording.pressed
        half = len(frames) // 2
        drawn = (frames[number // count * half + number % count * half // count] for number in numbers)
        return [(cells, errors.exact_zones(cells, judge)) for cells in drawn]


@functools.lru_cache(maxsize=4)
def _recording(path: str, digest: str, threshold: float | None) -> Recording:
    return Recording.load(path, threshold)


def source(name: str, seed: int | None = None, threshold: float | None = None) -> Source:
    """A source by name of a family or built-in scene, or by path: .toml of a scene file, .npz or .npy of a recording.

    ``seed`` replaces the file's. A recording's numbers above ``threshold`` are pressed. Families take precedence over
    scenes. Raises ValueError.
    """
    if name in FAMILIES:
        return Family(name, seed or 0)
    if name in CONTACTS:
        return BuiltIn(name, seed or 0)
    if name.endswith((".npz", ".npy")):
        with open_regular(name) as file:
            found = RecordingSource(name, hashlib.sha256(file.read()).hexdigest(), threshold)
        if (frames := len(found.recording.pressed)) < 4:
            raise ValueError(f"{name} has {frames} frames; two to choose with and two to report are the least")
        return found
    if name.endswith(".toml"):
        says = SceneFile.load(name)
        return File(says if seed is None else dataclasses.replace(says, seed=seed))
    known = ", ".join((*FAMILIES, *(name for name in CONTACTS if name not in FAMILIES)))
    raise ValueError(f"scene {name!r} is not known; take a .toml, .npz or .npy file, or one of {known}")


def default_count(sources: Sequence[Source]) -> int:
    """Scenes for the report: the most that a file requests."""
    return max((one.says.count for one in sources if isinstance(one, File)), default=COUNT)
