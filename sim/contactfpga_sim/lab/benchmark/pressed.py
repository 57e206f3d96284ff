"""Scenes on a sheet of tiles by finite elements: forces on the cells, and the contacts.

A body is flesh on a stiff core and presses patches of the tiles' tops. Flesh and tiles yield by what
:mod:`contactfpga_sim.lab.cover.elements` finds for a force on one patch, superposed. Both stiffen with strain: each
patch of foam by its own, the flesh by its mean. Contact is without friction. Lengths are in mm, forces in N, moduli in
MPa.
"""

from __future__ import annotations

import functools
import math
from typing import NamedTuple

import numpy as np
from scipy import fft, ndimage
from scipy.interpolate import RegularGridInterpolator

from contactfpga.design.cover import BODIES, Body, Cover, Ellipse, Part, medium
from contactfpga.skin import Skin
from contactfpga_sim.apps.covers import FOAM_M, GAP_MM
from contactfpga_sim.apps.errors import Blob
from contactfpga_sim.lab.cover.elements import Block
from contactfpga_sim.model.scenes.contacts import at
from contactfpga_sim.model.scenes.scene import Scene

PATCH_MM = 1.3
"""Rough width of a patch."""

FOAM_MM, FLESH_POISSON = 1e3 * FOAM_M, 0.45
REACH = 4.0
"""Thicknesses of flesh beyond which a force moves nothing."""

AWAY = 1e6
"""Height of patches beside a flat body."""

STIFFENED, SETTLED, MOST_STEPS = 4, 1e-3, 400


class Pressed(NamedTuple):
    """A scene as the cells take it."""

    forces_n: np.ndarray
    """(rows, columns) force on each cell."""
    contacts: list[Blob]
    """Contacts, apart if anything is free between them."""
    joined: list[Blob]
    """Contacts, one across gaps narrower than the foam is thick."""


class Tiles:
    """Foam tiles of a pitch, and the patches on them."""

    def __init__(self, pitch_mm: float):
        self.per = round(pitch_mm / PATCH_MM)
        self.step_mm, side = pitch_mm / self.per, pitch_mm - GAP_MM
        self.offsets_mm = side * ((np.arange(self.per) + 0.5) / self.per - 0.5)
        planes = np.linspace(-side / 2, side / 2, 2 * self.per + 1)
        block = Block(planes, planes, np.linspace(0, FOAM_MM, 5), medium.POISSON)
        axis = np.zeros((len(planes), self.per))
        for patch in range(self.per):  # a patch is two bricks wide, and its force is even
            axis[2 * patch : 2 * patch + 3, patch] = 0.25, 0.5, 0.25
        share = np.kron(axis, axis)
        moved = block.moved(Cover().modulus_pa / 1e6)[block.top, 2]
        self.compliance = share.T @ moved @ share
        """(n, n) displacement of each patch under 1 N on each patch of its tile."""


tiles = functools.cache(Tiles)


@functools.cache
def flesh(thickness_mm: float, step_mm: float) -> np.ndarray:
    """(n, n) displacement of flesh of 1 MPa, so many steps away in x and y, under 1 N on one patch.

    1 MPa is what a wide flat body finds, as the modulus of :class:`~contactfpga.design.cover.layers.Layer` is. Under a
    force on one node, nearly incompressible bricks move up and down in turns; so force and displacement are those of a
    patch and, by halves, of its neighbors.
    """
    away = step_mm * np.arange(math.ceil(REACH * thickness_mm / step_mm) + 4)
    near = away[away <= 2 * thickness_mm]
    planes = np.append(near, np.linspace(near[-1], away[-1] + thickness_mm, 7)[1:])
    block = Block(planes, planes, np.linspace(0, thickness_mm, 6), FLESH_POISSON, (True, True))
    wide = (1 - FLESH_POISSON) / (1 + FLESH_POISSON) / (1 - 2 * FLESH_POISSON)
    moved = block.moved(1 / wide, [0])[block.top, 2, 0].reshape(len(planes), -1) / 4  # for the quarter's part of 1 N
    quarter = RegularGridInterpolator((planes, planes), moved)(np.stack(np.meshgrid(away, away), axis=-1))
    for axis in (0, 1):
        whole = np.concatenate([np.flip(quarter, axis).take(range(len(away) - 1), axis), quarter], axis)
        whole = ndimage.convolve1d(whole, np.array([1, 4, 6, 4, 1]) / 16, axis)
        quarter = whole.take(range(len(away) - 1, 2 * len(away) - 3), axis)
    return quarter


class Contact:
    """A body on (n, m) patches of tiles; (n, m) ``height_mm`` is that of its core above each patch."""

    def __init__(self, pitch_mm: float, body: Body, height_mm: np.ndarray):
        self._tiles, self._body, self._height = tiles(pitch_mm), body, height_mm
        self._softer, self._yield = np.ones(height_mm.shape), 1.0
        self._kernel = np.zeros(0)
        if body.flesh is not None:
            quarter = flesh(1e3 * body.flesh.thickness_m, self._tiles.step_mm) / (body.flesh.modulus_pa / 1e6)
            shape = tuple(fft.next_fast_len(side + len(quarter), real=True) for side in height_mm.shape)
            away = [np.minimum(np.arange(side), side - np.arange(side)) for side in shape]
            whole = np.pad(quarter, [(0, max(0, side // 2 + 1 - len(quarter))) for side in shape])
            self._kernel, self._shape = fft.rfft2(whole[np.ix_(*away)]), shape

    def moved(self, force: np.ndarray) -> np.ndarray:
        """Displacement of the patches against the core under (n, m) forces."""
        return self._foam(force) + self._flesh(force)

    def _foam(self, force: np.ndarray) -> np.ndarray:
        per, (rows, columns) = self._tiles.per, force.shape
        split = (rows // per, per, columns // per, per)
        own = (force * self._softer).reshape(split).transpose(0, 2, 1, 3).reshape(-1, per * per)
        found = (own @ self._tiles.compliance).reshape(rows // per, columns // per, per, per)
        return found.transpose(0, 2, 1, 3).reshape(rows, columns) * self._softer

    def _flesh(self, force: np.ndarray) -> np.ndarray:
        if not len(self._kernel):
            return np.zeros(force.shape)
        found = fft.irfft2(fft.rfft2(force, self._shape) * self._kernel, self._shape)
        return self._yield * found[: force.shape[0], : force.shape[1]]

    def pressed(self, force_n: float) -> np.ndarray:
        """(n, m) forces of at least 0 whose sum is ``force_n``, once foam and flesh are as stiff as their strain makes
        them: E/(1 - e), as in the tests of the layers."""
        force = np.where(self._height <= self._height.min() + 0.3, 1.0, 0.0)
        for _ in range(STIFFENED):
            force = self._touching(force * force_n / force.sum(), force_n)
            strain = self._foam(force) / FOAM_MM
            self._softer = np.sqrt(self._softer**2 / (self._softer**2 + strain))
            if self._body.flesh is not None:
                deep = (self._flesh(force) * force).sum() / force_n / (1e3 * self._body.flesh.thickness_m)
                self._yield /= self._yield + deep
        return force

    def _touching(self, force: np.ndarray, force_n: float) -> np.ndarray:
        """Conjugate gradients within the patches that touch (Polonsky and Keer, Wear 231 (1999) 206)."""
        along, last, keep = np.zeros(force.shape), 1.0, 0.0
        for _ in range(MOST_STEPS):
            gap = self.moved(force) + self._height
            touch = force > 0
            gap -= gap[touch].mean()
            size = float(np.square(gap[touch]).sum())
            along = np.where(touch, gap + keep * size / last * along, 0)
            answer = self.moved(along)
            answer -= answer[touch].mean()
            if size:
                step = (gap * along)[touch].sum() / (answer * along)[touch].sum()
            else:  # One patch has no differences of gaps, so its own stiffness gives the step.
                step, size = force_n / self.moved(force).max(), 1.0
            new = np.maximum(0, np.where(touch, force - step * along, 0))
            met = (new == 0) & (gap < 0)
            new[met] -= step * gap[met]
            new *= force_n / new.sum()
            last, keep, change = size, float(not met.any()), np.abs(new - force).sum()
            force = new
            if change < SETTLED * force_n:
                return force
        raise AssertionError("the contact does not settle")


class Patches(NamedTuple):
    """Forces on the patches of a sheet."""

    force_n: np.ndarray
    """(n, m)."""
    x_mm: np.ndarray
    """(m,): middles of the patches along the columns; those of a tile lie side by side."""
    y_mm: np.ndarray
    """(n,): middles along the rows."""
    per: int
    """Patches of a tile in each direction."""

    @property
    def cells_n(self) -> np.ndarray:
        """(rows, columns) force on each cell."""
        rows, columns = (side // self.per for side in self.force_n.shape)
        return self.force_n.reshape(rows, self.per, columns, self.per).sum(axis=(1, 3))


def patches(scene: Scene, skin: Skin) -> Patches:
    """A scene at rest, as it is drawn: its bodies are not yet on a cover. Each presses as if it were alone."""
    sheet = tiles(skin.pitch_x_mm)
    x, y = (
        (skin.pitch_x_mm * np.arange(lines)[:, None] + sheet.offsets_mm).ravel() for lines in (skin.columns, skin.rows)
    )
    force = np.zeros((len(y), len(x)))
    for contact in scene.contacts:
        body, load = BODIES[str(contact.body)], contact.load(0.0)
        assert load is not None
        height = np.min([_height_mm(part, 1e3 * body.depth_m, x, y) for part in load.parts], axis=0)
        near = tuple(_window(height < 3e3 * body.depth_m, axis, sheet.per) for axis in (1, 0))
        force[near] += Contact(skin.pitch_x_mm, body, height[near]).pressed(at(contact.force_n, 0.0))
    return Patches(force, x, y, sheet.per)


def pressed(scene: Scene, skin: Skin) -> Pressed:
    """The forces and contacts of :func:`patches`."""
    found = patches(scene, skin)
    touched, x, y, step_mm = found.force_n > 0, found.x_mm, found.y_mm, tiles(skin.pitch_x_mm).step_mm
    bridged = ndimage.binary_closing(np.pad(touched, 2), np.ones((2, 2)))[2:-2, 2:-2]
    both = (_contacts(touched, ndimage.label(how, np.ones((3, 3)))[0], x, y, step_mm**2) for how in (touched, bridged))
    return Pressed(found.cells_n, *both)


def _height_mm(part: Part, depth_mm: float, x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Height of a part of the core: a paraboloid with its half axes at the depth, or a flat."""
    if not isinstance(part, Ellipse):
        return np.where(part.contains(x * 1e-3, y[:, None] * 1e-3), 0.0, AWAY)
    cosine, sine = math.cos(part.angle_rad), math.sin(part.angle_rad)
    right, down = x - 1e3 * part.x_m, y[:, None] - 1e3 * part.y_m
    along, across = cosine * right + sine * down, cosine * down - sine * right
    return depth_mm * ((along / (1e3 * part.half_x_m)) ** 2 + (across / (1e3 * part.half_y_m)) ** 2)


def _window(near: np.ndarray, axis: int, per: int) -> slice:
    """Whole tiles along one direction that hold all near patches."""
    places = np.flatnonzero(near.any(axis=axis))
    return slice(places[0] // per * per, (places[-1] // per + 1) * per)


def _contacts(touched: np.ndarray, contact: np.ndarray, x: np.ndarray, y: np.ndarray, patch_mm2: float) -> list[Blob]:
    row, column = np.nonzero(touched)
    owner = contact[row, column] - 1
    area = np.bincount(owner)
    middles = [np.bincount(owner, place) / area for place in (x[column], y[row])]
    return [
        Blob(one * patch_mm2, *place) for one, *place in zip(area.tolist(), *(middle.tolist() for middle in middles))
    ]
