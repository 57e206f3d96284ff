"""Contact surfaces on tiles against the contacts that press them, by the cover's model and by finite elements."""

from __future__ import annotations

import zlib
from typing import NamedTuple

import numpy as np
from scipy import ndimage
from scipy.spatial import ConvexHull

from contactfpga.design.cover import Cells, Cover, Switch
from contactfpga.robot.body.support import FIRM_PA, ContactSurfaces, Support
from contactfpga.skin import Skin
from contactfpga.wire.protocol import Frame
from contactfpga.zones.zone import Zones
from contactfpga_sim.apps import pool
from contactfpga_sim.apps.covers import MOST_ZONES, tiled
from contactfpga_sim.lab.benchmark.pressed import Patches, patches
from contactfpga_sim.lab.body.folding import frame_of
from contactfpga_sim.lab.chart.methods import sheet
from contactfpga_sim.model.golden.label import labelling
from contactfpga_sim.model.scenes import contacts
from contactfpga_sim.model.scenes.contacts import Contact, Shape
from contactfpga_sim.model.scenes.families import place, placements
from contactfpga_sim.model.scenes.scene import Scene

DESIGNS = {"4 mm, 0.1 N": (4.0, 0.1), "6.4 mm, 0.4 N": (6.4, 0.4)}
"""Pitch in mm and closing force in N of the cells, which are spread by :data:`SPREAD`."""
SPREAD = 0.1
FAMILIES = ("bumper", "fingers", "pair", "palm", "edge")
SUPPORTS = ("long edge", "corner", "plate", "bar")
MODELS = ("model", "elements")
SCENES, PIECE = 40, 10
"""Scenes of a kind by each model, and per piece of work."""
FINE = 8
"""Points per pitch at which the model's pressure is read."""


class Zone(NamedTuple):
    """A zone beside the contacts that lie on its cells."""

    center: bool
    """Whether the center of pressure of what presses nearest to this zone lies in the polygon."""
    area: float
    """Area of the polygon over that of their convex hull."""
    rectangle: float
    """The same of the rectangle from the extent."""
    several: bool
    """Whether they are several."""
    doubted: bool
    """Whether the polygon is said to hold two contacts."""


class Outcome(NamedTuple):
    """One scene."""

    held: list[bool]
    """For each contact that presses by more than :data:`FIRM_PA` anywhere: whether all such points are in one
    polygon."""
    force: list[float]
    """Share of the force of each contact within the polygon that holds most of it; 0 if no cell closed."""
    zones: list[Zone]


def support(kind: str, rng: np.random.Generator, skin: Skin) -> Scene:
    """A rigid thing on which the sheet leans, at a random place and angle; what lies beyond the sheet carries nothing.

    ``long edge``: of a table, 3 to 6 mm wide, across the whole sheet; ``corner``: of a box of 120 mm, that lies on at
    least 20 mm of the sheet; ``plate``: a square of 40 to 80 mm; ``bar``: a limb on a flat plate, round across.
    """
    angle, force = rng.uniform(0, 180), rng.uniform(100, 400)
    far = 1e3 * skin.columns * skin.pitch_x_mm * contacts.M
    if kind == "long edge":
        shape, x, y = contacts.edge(3 * far, rng.uniform(3, 6)), *rng.uniform(0.3 * far, 0.7 * far, 2)
    elif kind == "corner":
        shape, (x, y) = contacts.edge(120, 120), rng.choice([0, far], 2) + rng.uniform(-40, 40, 2)
        angle = rng.uniform(-20, 20)
    else:
        half = rng.uniform(20, 40)
        shape = contacts.edge(2 * half, 2 * half)
        if kind == "bar":
            shape = contacts.ellipse(1.5 * half, rng.uniform(5, 10))
        x, y = place(rng, skin, _turned(shape, angle))
    return Scene((Contact(shape=shape, x_mm=float(x), y_mm=float(y), angle_deg=angle, force_n=force, body="rigid"),))


def _turned(shape: Shape, angle_deg: float) -> Shape:
    return tuple(part.placed(0.0, 0.0, np.radians(angle_deg)) for part in shape)


def scene(kind: str, number: int, skin: Skin) -> Scene:
    if kind in FAMILIES:
        (found,) = placements(kind, 1, 7, skin, number)
        return found
    return support(kind, np.random.default_rng([zlib.crc32(kind.encode()), number]), skin)


def modeled(drawn: Scene, skin: Skin, cover: Cover) -> Patches:
    """A scene pressed by the cover's model, as the force around each point."""
    x, y = (
        skin.pitch_x_mm * ((np.arange(FINE * lines) + 0.5) / FINE - 0.5) for lines in (skin.columns, skin.rows)
    )  # pitches are equal
    force = np.zeros((len(y), len(x)))
    for load in drawn.on_cover(skin, cover).loads(0.0):
        shares = [each * part.density(1e-3 * x, 1e-3 * y[:, None]) for part, each in load.shares()]
        force += load.force_n * np.sum(shares, axis=0) / np.sum(shares)
    return Patches(force, x, y, FINE)


class Drawn(NamedTuple):
    """A scene as it presses, and what is reported of it."""

    there: Patches
    cells: np.ndarray
    supports: list[Support]
    rectangles: list[Support]


def drawn(design: str, model: str, kind: str, number: int) -> Drawn:
    pitch, force = DESIGNS[design]
    skin = sheet(pitch, report="cells")
    cover = tiled(pitch, Switch(force, travel_m=0.0, spread=SPREAD))
    one = scene(kind, number, skin)
    there = patches(one, skin) if model == "elements" else modeled(one, skin, cover)
    limits = Cells(cover, skin.rows, skin.columns, 1e-3 * pitch, 1e-3 * pitch, number).thresholds_n
    cells = there.cells_n >= limits
    supports = ContactSurfaces(skin.sheet, cover).supports(frame_of(cells, skin.sheet))
    extents = extents_of(cells, pitch)
    return Drawn(there, cells, supports, ContactSurfaces(extents.sheet, cover).supports(extents))


def extents_of(cells: np.ndarray, pitch_mm: float) -> Zones:
    """The frame of (rows, columns) bool cells of a flat sheet that sends only moments and extents of its zones."""
    rows, columns = cells.shape
    size = {"rows": rows, "columns": columns, "pitch_x_mm": pitch_mm, "pitch_y_mm": pitch_mm}
    skin = Skin(**size, connectivity=4, zone_capacity=MOST_ZONES, extent=True)
    departures = labelling(cells, skin.connectivity).departures
    moments = np.array([(each.area, each.sum_x, each.sum_y) for each in departures], np.int64).reshape(-1, 3)
    extents = np.array([each.extent for each in departures], np.int64).reshape(-1, 4)
    frame = Frame(0, 0, frozenset(), 0, 0, len(moments), int(cells.sum()), moments, None, extents=extents)
    return Zones(frame, skin.sheet, 0)


def outcome(found: Drawn, pitch_mm: float) -> Outcome:
    there = found.there
    contact, count = ndimage.label(there.force_n > 0, np.ones((3, 3)))
    rows, columns = np.nonzero(contact)
    force, owner = there.force_n[rows, columns], contact[rows, columns] - 1
    points = np.stack([there.x_mm[columns], there.y_mm[rows]], axis=1)
    firm = force > FIRM_PA * (1e-3 * pitch_mm / there.per) ** 2
    inside = np.array([within(one, points) for one in found.supports]).reshape(-1, len(points))
    held, shares = [], []
    for number in range(count):
        mine = owner == number
        if firm[mine].any():
            held.append(bool(inside[:, mine & firm].all(axis=1).any()))
        shares.append(float((inside[:, mine] @ force[mine]).max(initial=0) / force[mine].sum()))
    labels = ndimage.label(found.cells)[0]  # sheets of the study join cells by edges
    nearest = labels[tuple(ndimage.distance_transform_edt(labels == 0, return_distances=False, return_indices=True))]
    zone_of, near = (each[rows // there.per, columns // there.per] for each in (labels, nearest))
    zones = []
    for one, other, hit in zip(found.supports, found.rectangles, inside):
        label = zone_of[hit & (zone_of > 0)]
        if not len(label):
            continue
        own = np.bincount(label).argmax()
        mine = np.isin(owner, np.unique(owner[zone_of == own]))
        center = np.average(points[mine & (near == own)], axis=0, weights=force[mine & (near == own)])
        corners = points[mine][:, None] + pitch_mm / there.per / 2 * np.array([(-1, -1), (-1, 1), (1, -1), (1, 1)])
        true = 1e-6 * ConvexHull(corners.reshape(-1, 2)).volume
        doubted = any("two contacts" in doubt for doubt in one.doubts)
        several = len(np.unique(owner[mine])) > 1
        zones.append(
            Zone(bool(within(one, center[None])[0]), one.area_m2 / true, other.area_m2 / true, several, doubted)
        )
    return Outcome(held, shares, zones)


def within(support: Support, points_mm: np.ndarray) -> np.ndarray:
    """(n,) bool: which points of a flat sheet a polygon holds, by its edges' normals."""
    corners = 1e3 * support.corners_m[:, :2]
    ways = np.roll(corners, -1, axis=0) - corners
    away = np.stack([-ways[:, 1], ways[:, 0]], axis=1)
    found: np.ndarray = (points_mm @ away.T >= (corners * away).sum(axis=1) - 1e-6).all(axis=1)
    return found


def outcomes(design: str, model: str, kind: str, first: int) -> list[Outcome]:
    numbers = range(first, first + PIECE)
    return [outcome(drawn(design, model, kind, number), DESIGNS[design][0]) for number in numbers]


def compute() -> dict[tuple[str, str, str], list[Outcome]]:
    """Outcomes of all scenes by design, kind and model."""
    keys = [(design, kind, model) for design in DESIGNS for kind in (*FAMILIES, *SUPPORTS) for model in MODELS]
    tasks = [(design, model, kind, first) for design, kind, model in keys for first in range(0, SCENES, PIECE)]
    with pool.executor() as workers:
        pieces = iter(workers.map(outcomes, *zip(*tasks)))
        return {key: [one for _ in range(0, SCENES, PIECE) for one in next(pieces)] for key in keys}
