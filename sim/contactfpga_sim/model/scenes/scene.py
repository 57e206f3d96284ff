"""Touches of the sheet: contacts over time, recordings, and scenes by name."""

from __future__ import annotations

import dataclasses
import functools
import math
from collections.abc import Callable
from pathlib import Path

import numpy as np

from contactfpga.design.cover import Cover, Load, cells_of
from contactfpga.inputs.values import suggestion
from contactfpga.skin import Skin
from contactfpga_sim.model.scenes import cells, contacts
from contactfpga_sim.model.scenes.contacts import Contact, Round, Swing
from contactfpga_sim.model.scenes.recordings import Recording
from contactfpga_sim.model.scenes.shapes import SHAPES
from contactfpga_sim.model.scenes.truth import Box, Truth, all_loads, truth_around, truth_of

CellsAt = Callable[[float], np.ndarray]
"""A function from time in s to pressed (rows, columns) bool cells."""

FINGER_MM = 12.0
"""Radius of a fingertip's contact."""

FOOT_MM = 260.0
"""Greatest length of a foot."""


@dataclasses.dataclass(frozen=True)
class Scene:
    """Contacts over time, placed on the sheet laid flat, for sheets of any pitch and size. On a closed sheet a contact
    beyond one end is also at the other."""

    contacts: tuple[Contact, ...]
    drawn: int = 0
    """Seed of the closing forces of the sheet that is touched, where a cover spreads them."""

    def loads(self, seconds: float) -> list[Load]:
        """Loads on the cover at a time."""
        found = (contact.load(seconds) for contact in self.contacts)
        return [load for load in found if load is not None]

    def truth(self, seconds: float, skin: Skin | None = None) -> Truth:
        """Contacts with areas in mm2 and barycenters in mm at a time, from the continuous shapes: overlapping or
        touching parts are one contact. With a Skin only the part on its sheet counts, up to half a pitch beyond the
        outermost switches."""
        parts = [part for load in self.loads(seconds) for part in load.parts]
        if skin is None:
            return truth_of(parts)
        return truth_around(parts, sheet(skin), around_m(skin)) if skin.closed else truth_of(parts, sheet(skin))

    @property
    def settled_s(self) -> float:
        """Time by which all bodies that come to a sheet have their forces, of a scene :meth:`on_cover`; 0 without
        any."""
        shapes = (contact.shape for contact in self.contacts)
        depths = (shape.depth_m for shape in shapes if isinstance(shape, contacts.PressedParts))
        return max((depth.seconds for depth in depths if isinstance(depth, contacts.Approach)), default=0.0)

    def on_cover(self, skin: Skin, cover: Cover | None = None) -> Scene:
        """The scene as its bodies are pressed on a cover (None: a bare sheet) over switches of the Skin's pitch."""
        return _on_cover(self, skin.pitch_x_mm, skin.pitch_y_mm, cover)

    def approaching(self, speed_mm_s: float) -> Scene:
        """The scene with all bodies touching at 0 s and coming at this speed."""
        coming = tuple(dataclasses.replace(contact, speed_mm_s=speed_mm_s) for contact in self.contacts)
        return dataclasses.replace(self, contacts=coming)

    def pressed(
        self, seconds: float, skin: Skin, cover: Cover | None = None, before: np.ndarray | None = None
    ) -> np.ndarray:
        """(rows, columns) bool: closed switches at a time. ``cover``: None for a bare sheet, whose switches close under
        a contact whatever its force. ``before``: switches closed until then, for hysteresis. ``skin.mask`` is ignored,
        as the gateware applies it."""
        loads = self._loads(seconds, skin, cover)
        pitch_x, pitch_y = skin.pitch_x_mm * contacts.M, skin.pitch_y_mm * contacts.M
        if cover is not None and cover.model != "patch":
            return cells_of(cover, skin.rows, skin.columns, pitch_x, pitch_y, self.drawn).closed(loads, before)
        return (cover or Cover()).under(
            loads, np.arange(skin.columns) * pitch_x, np.arange(skin.rows)[:, None] * pitch_y
        )

    def forces_n(self, seconds: float, skin: Skin, cover: Cover) -> np.ndarray:
        """(rows, columns) force on each cell at a time, under a cover that goes by force."""
        pitch_x, pitch_y = skin.pitch_x_mm * contacts.M, skin.pitch_y_mm * contacts.M
        cells = cells_of(cover, skin.rows, skin.columns, pitch_x, pitch_y, self.drawn)
        return cells.forces_n(self._loads(seconds, skin, cover))

    def _loads(self, seconds: float, skin: Skin, cover: Cover | None) -> list[Load]:
        loads = self.on_cover(skin, cover).loads(seconds)
        return all_loads(loads, sheet(skin).left, around_m(skin)) if skin.closed else loads

    def on(self, skin: Skin, cover: Cover | None = None) -> CellsAt:
        """:meth:`pressed` on this sheet as a function of time. Hysteresis depends on the previous call, so times should
        rise."""
        if all(contact.still for contact in self.contacts):
            still = self.pressed(0.0, skin, cover)
            return lambda seconds: still
        if cover is None or not cover.switch.hysteresis:
            return lambda seconds: self.pressed(seconds, skin, cover)
        before = np.zeros((skin.rows, skin.columns), bool)

        def remembering(seconds: float) -> np.ndarray:
            nonlocal before
            before = self.pressed(seconds, skin, cover, before)
            return before

        return remembering


@functools.lru_cache(maxsize=4096)
def _on_cover(scene: Scene, pitch_x_mm: float, pitch_y_mm: float, cover: Cover | None) -> Scene:
    pressed = tuple(contact.on(cover, pitch_x_mm, pitch_y_mm) for contact in scene.contacts)
    return dataclasses.replace(scene, contacts=pressed)


def sheet(skin: Skin) -> Box:
    """The sheet laid flat, in m, with half a pitch beyond the outermost switches."""
    x, y = skin.pitch_x_mm * contacts.M, skin.pitch_y_mm * contacts.M
    return Box(-x / 2, (skin.columns - 0.5) * x, -y / 2, (skin.rows - 0.5) * y)


def around_m(skin: Skin) -> float:
    """Length of the sheet along its columns in m."""
    return skin.columns * skin.pitch_x_mm * contacts.M


def _extent(skin: Skin) -> tuple[float, float]:
    return (skin.columns - 1) * skin.pitch_x_mm, (skin.rows - 1) * skin.pitch_y_mm


def fingertip(skin: Skin) -> Scene:
    """A fingertip at rest, a third into the sheet."""
    width, height = _extent(skin)
    return Scene((Contact(shape=contacts.disc(FINGER_MM), x_mm=width / 3, y_mm=height / 3),))


def two_fingers(skin: Skin) -> Scene:
    """Two fingertips with a free column between them, on a single column a free row."""
    width, height = _extent(skin)
    gap, angle = (1.01 * skin.pitch_y_mm, 90.0) if skin.columns == 1 else (1.01 * skin.pitch_x_mm, 0.0)
    return Scene(contacts.pair(gap, FINGER_MM, width / 2, height / 2, angle))


def palm(skin: Skin) -> Scene:
    """A hand laid flat in the middle."""
    width, height = _extent(skin)
    return Scene((Contact(shape=contacts.palm(), x_mm=width / 2, y_mm=height / 2 - 8, force_n=40.0),))


def palm_and_fingers(skin: Skin) -> Scene:
    """The flat of a hand below two fingertips, of which the left one presses twice as hard; as large as fits."""
    width, height = _extent(skin)
    scale = min(1.0, max(0.1, min(width, height) / 160))
    x, y, hand = width / 2, height / 2, contacts.palm(scale)
    found = [Contact(shape=hand, body="palm", x_mm=x, y_mm=y + 20 * scale, force_n=60 * scale**2)]
    for side, force in ((-1, 20.0), (1, 10.0)):
        tip, at_mm = contacts.disc(FINGER_MM * scale), x + side * 35 * scale
        found.append(Contact(shape=tip, x_mm=at_mm, y_mm=y - 60 * scale, force_n=force * scale**2))
    return Scene(tuple(found))


def sole(skin: Skin) -> Scene:
    """A bare foot in the middle, along the longer side, as long as fits."""
    width, height = _extent(skin)
    along, angle = (height + 0.9 * skin.pitch_y_mm, 0.0) if height >= width else (width + 0.9 * skin.pitch_x_mm, 90.0)
    shape = contacts.sole(min(FOOT_MM, along))
    return Scene((Contact(shape=shape, x_mm=width / 2, y_mm=height / 2, angle_deg=angle, force_n=350.0),))


def edge(skin: Skin) -> Scene:
    """A straight edge, 20 degrees off the rows, that presses a switch in each column."""
    width, height = _extent(skin)
    shape = contacts.edge(2 * (width + height) + 100, 1.1 * skin.pitch_y_mm)
    return Scene((Contact(shape=shape, x_mm=width / 2, y_mm=height / 2, angle_deg=20.0, force_n=40.0),))


def moving(skin: Skin) -> Scene:
    """A fingertip that circles around the middle twice a second."""
    width, height = _extent(skin)
    x = Swing(width / 2, 0.3 * width, 2.0)
    y = Swing(height / 2, 0.3 * height, 2.0, -math.pi / 2)
    return Scene((Contact(shape=contacts.disc(FINGER_MM), x_mm=x, y_mm=y),))


def pushing(skin: Skin) -> Scene:
    """Two fingertips whose forces swing in opposition between 2 and 18 N, once per second."""
    width, height = _extent(skin)
    left, right = Swing(10.0, 8.0, 1.0), Swing(10.0, 8.0, 1.0, math.pi)
    places = ((0.3 * width, 0.35 * height, left), (0.7 * width, 0.65 * height, right))
    return Scene(
        tuple(Contact(shape=contacts.disc(FINGER_MM), x_mm=x, y_mm=y, force_n=force) for x, y, force in places)
    )


def nothing(skin: Skin) -> Scene:
    """An untouched sheet."""
    return Scene(())


def around(skin: Skin) -> Scene:
    """A fingertip that circles the limb of a closed sheet twice per second; on an open sheet it leaves at the last
    column and returns at the first."""
    _, height = _extent(skin)
    start = -skin.pitch_x_mm / 2
    x = Round(start, skin.columns * skin.pitch_x_mm, 2.0)
    return Scene((Contact(shape=contacts.disc(FINGER_MM), x_mm=x, y_mm=height / 2),))


def grip(skin: Skin) -> Scene:
    """A hand around the limb of a closed sheet; on an open sheet, a bar across all columns."""
    width, height = _extent(skin)
    shape = contacts.edge(width + 2 * skin.pitch_x_mm, max(1.1 * skin.pitch_y_mm, 0.3 * height))
    return Scene((Contact(shape=shape, x_mm=width / 2, y_mm=height / 2, force_n=60.0),))


CONTACTS: dict[str, Callable[[Skin], Scene]] = {
    scene.__name__: scene
    for scene in (fingertip, two_fingers, palm, palm_and_fingers, sole, edge, moving, pushing, nothing)
}

AROUND: dict[str, Callable[[Skin], Scene]] = {scene.__name__: scene for scene in (around, grip)}
"""Contact scenes for closed sheets, by name."""

_BY_NAME = CONTACTS | AROUND

NAMES = (*_BY_NAME, *SHAPES)
"""Names that :func:`scene` accepts."""

Source = str | Path | np.ndarray | Scene | Recording | CellsAt | None
"""Argument of :func:`scene`."""


def scene(skin: Skin, source: Source = None, cover: Cover | None = None) -> CellsAt:
    """Pressed cells of a scene on a sheet, as a function of time.

    ``source``: one of :data:`NAMES` (default: fingertip); a Scene; a Recording, its .npy or .npz file, or an array
    (rows, columns) or (frames, rows, columns), played in a loop; or a function of time. ``cover``: through which
    contacts press. Raises ValueError for anything else.
    """
    if source is None:
        source = "fingertip"
    if isinstance(source, Scene):
        return source.on(skin, cover)
    if isinstance(source, Recording):
        return source.on(skin)
    if isinstance(source, np.ndarray):
        return Recording.of(source, "the array").on(skin)
    if callable(source):
        return _checked(skin, source)
    name = str(source)
    if name in _BY_NAME:
        return _BY_NAME[name](skin).on(skin, cover)
    if name in SHAPES:
        shape = SHAPES[name](skin.rows, skin.columns)
        return lambda seconds: shape
    if not name.endswith((".npy", ".npz")):
        raise ValueError(f"scene {name!r} is not known, and no .npy or .npz file; {suggestion(name, NAMES)}")
    return Recording.load(name).on(skin)


def contacts_of(skin: Skin, source: Source) -> Scene | None:
    """Contacts of a Scene or of its name; None for other sources."""
    if isinstance(source, Scene):
        return source
    if source is None:
        source = "fingertip"
    return _BY_NAME[source](skin) if isinstance(source, str) and source in _BY_NAME else None


def _checked(skin: Skin, callback: CellsAt) -> CellsAt:
    def scene(seconds: float) -> np.ndarray:
        found = np.asarray(callback(seconds))
        if found.shape != (skin.rows, skin.columns):
            raise ValueError(f"the scene gave cells of shape {found.shape}; the sheet has {skin.rows}x{skin.columns}")
        return cells.pressed(found, "what the scene gave")

    return scene
