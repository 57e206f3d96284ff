"""Scenes of a scene file: each by its number alone, on a sheet of any pitch."""

from __future__ import annotations

import math

import numpy as np

from contactfpga.skin import Skin
from contactfpga_sim.model.scenes.contacts import Contact, GrowingPatch, M, Shape, Track, Value, approaching
from contactfpga_sim.model.scenes.cylinder import on_all_turns
from contactfpga_sim.model.scenes.families import TRIES, Random, place
from contactfpga_sim.model.scenes.file import Kind, Range, SceneFile, SceneFileError
from contactfpga_sim.model.scenes.scene import Scene, around_m, sheet
from contactfpga_sim.model.scenes.truth import Box, widths

DIRECTIONS = 128
"""In which the distance of two shapes is looked for; it comes out short by at most 0.03 % of their size."""

PLACES = 10
"""Places that are tried for a contact beside others, before the scene is drawn again."""


def scene_of(file: SceneFile, number: int, skin: Skin) -> tuple[Scene, float]:
    """Scene ``number`` of a file on a sheet, and the instant in s at which it is looked at: not before all forces that
    rise with an approach have risen.

    Depends on what the file says, the number, and the sheet's pitch and size. Raises SceneFileError where contacts
    cannot be as far apart as the file asks.
    """
    rng = np.random.default_rng([file.seed, number])
    for _ in range(TRIES):
        if (contacts := _apart(rng, file, skin)) is not None:
            scene = Scene(contacts)
            return scene, max(scene.settled_s, float(rng.uniform(0, file.seconds)))
    left, right, top, bottom = (end / M for end in sheet(skin))
    assert file.gap_mm is not None
    raise SceneFileError(
        f"gap_mm is {file.gap_mm:g}; contacts found no places so far apart in {TRIES} tries on a sheet of "
        f"{right - left:g} x {bottom - top:g} mm"
    )


def _apart(rng: Random, file: SceneFile, skin: Skin) -> tuple[Contact, ...] | None:
    """All contacts of a scene; None where one was not as far as asked from the others in some tries."""
    placed: list[tuple[Shape, Contact]] = []
    for kind in file.kinds:
        for _ in range(int(rng.integers(kind.number[0], kind.number[1] + 1))):
            for _ in range(PLACES):
                contact = _drawn(rng, file, kind, skin)
                begin = _start(contact)
                if file.gap_mm is None or all(_gap_mm(begin, other, skin) >= file.gap_mm for other, _ in placed):
                    placed.append((begin, contact))
                    break
            else:
                return None
    return tuple(contact for _, contact in placed)


def _start(contact: Contact) -> Shape:
    """Its parts at 0 s, whether it presses yet or not."""
    x, y, angle = (
        value(0.0) if callable(value) else value for value in (contact.x_mm, contact.y_mm, contact.angle_deg)
    )
    shape = contact.shape.shape if isinstance(contact.shape, GrowingPatch) else contact.shape
    assert not callable(shape)
    return tuple(part.placed(x * M, y * M, math.radians(angle)) for part in shape)


def _drawn(rng: Random, file: SceneFile, kind: Kind, skin: Skin) -> Contact:
    shape = kind.outline(rng)
    angle, force = (_value(rng, value) for value in (kind.angle_deg, kind.force_n))
    turned = tuple(part.placed(0.0, 0.0, math.radians(angle(0.0) if callable(angle) else angle)) for part in shape)
    x, y = place(rng, skin, turned)
    speed, heading = kind.speed_mm_s.draw(rng), math.radians(kind.heading_deg.draw(rng))
    left, _, top, _ = (end / M for end in sheet(skin))
    drawn = Contact(
        shape=shape,
        x_mm=_along(rng, kind.x_mm, left, x, speed * math.cos(heading), file.seconds),
        y_mm=_along(rng, kind.y_mm, top, y, speed * math.sin(heading), file.seconds),
        angle_deg=angle,
        force_n=force,
    )
    return drawn if kind.approach_mm_s is None else approaching(drawn, kind.approach_mm_s.draw(rng))


def _value(rng: Random, value: Range | Track) -> Value:
    return value if isinstance(value, Track) else value.draw(rng)


def _along(
    rng: Random, given: Range | Track | None, edge: float, anywhere: float, speed: float, seconds: float
) -> Value:
    """A place in mm over time; ``edge`` is where the sheet begins."""
    if isinstance(given, Track):
        return Track(given.seconds, tuple(edge + value for value in given.values))
    start = anywhere if given is None else edge + given.draw(rng)
    return Track((0.0, seconds), (start, start + speed * seconds)) if speed and seconds else start


def _gap_mm(one: Shape, other: Shape, skin: Skin) -> float:
    """How far two shapes are apart on the sheet, around a closed one either way."""
    if skin.closed:
        around = around_m(skin)
        ends = [end for part in one for end in widths(part, Box())]
        other = tuple(on_all_turns(other, Box(min(ends) - around, max(ends) + around), around))
    return distance_mm(one, other)


def distance_mm(one: Shape, other: Shape) -> float:
    """How far two shapes are apart; 0 or less where they meet.

    Convex sets are as far apart as the widest strip that parts them: the greatest -h_A(u) - h_B(-u) over all
    directions u, where h is how far a set reaches (Boyd and Vandenberghe, Convex Optimization, 8.2).
    """
    ahead, back = _reach(one), np.roll(_reach(other), DIRECTIONS // 2, axis=1)
    return float((-ahead[:, None] - back[None]).max(axis=2).min()) / M


def _reach(shape: Shape) -> np.ndarray:
    """(parts, directions): how far each part reaches from the origin, in m."""
    angles = np.arange(DIRECTIONS) * (2 * math.pi / DIRECTIONS)
    along = np.cos(angles), np.sin(angles)
    return np.array([part.x_m * along[0] + part.y_m * along[1] + part.reach_m(angles) for part in shape])
