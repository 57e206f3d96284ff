"""Readings of pressure units under a touched bumper."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from contactfpga.choices import converters
from contactfpga.robot.haptics import Cylinder, LoadCells
from contactfpga.skin import Skin
from contactfpga.surfaces.shapes import Floats
from contactfpga_sim.model.scenes.contacts import Contact, at
from contactfpga_sim.model.scenes.scene import Scene


class LoadedUnits:
    """Noisy readings of units under a wrench, in whole converter steps.

    Redundant units share a load by least squares; an unloaded unit reads as without preload.
    """

    def __init__(self, cells: LoadCells, skin: Skin, seed: int = 0, noise: bool = True):
        self._zeros = cells.zeros
        self._full = (1 << converters.find(skin.converter).bits) - 1
        self._steps = np.linalg.pinv(cells.matrix)
        self._rng = np.random.default_rng(seed)
        gains = np.abs([unit.gain_n for unit in cells.units])
        self._sigma = np.array([unit.sigma_n for unit in cells.units]) / gains * noise
        preloads = np.array([np.inf if unit.preload_n is None else unit.preload_n for unit in cells.units])
        self._least = -preloads / gains

    def exactly(self, wrench: Floats) -> Floats:
        """(n,): readings without noise, rounding and limits, under a (6,) wrench on the link in N and Nm."""
        return np.asarray(np.maximum(self._steps @ wrench, self._least) + self._zeros)

    def under(self, wrench: Floats) -> Sequence[int]:
        """Readings under a (6,) wrench."""
        noisy = self.exactly(wrench) + self._sigma * self._rng.standard_normal(len(self._sigma))
        found: list[int] = np.clip(np.rint(noisy), 0, self._full).astype(int).tolist()
        return found


class UnitReadings(LoadedUnits):
    """Readings over time in s while a scene touches the bumper."""

    def __init__(self, scene: Scene, cells: LoadCells, skin: Skin, seed: int = 0, noise: bool = True):
        """Raises ValueError if the cells have no surface."""
        super().__init__(cells, skin, seed, noise)
        if cells.surface is None:
            raise ValueError("the units have no surface; give units.toml a table [surface] with the bumper's outside")
        self._scene, self._cells, self._surface = scene, cells, cells.surface
        self.touching = Scene(())
        """Touches besides the scene."""
        outside = cells.surface.radius_m if isinstance(cells.surface, Cylinder) else None
        # A sheet around a cylinder lies under the foam, on whose outside things push.
        self._wider = 1e3 * outside / skin.radius_mm if outside and skin.radius_mm else 1.0

    def wrench(self, seconds: float) -> Floats:
        """(6,): wrench of all contacts on the link."""
        contacts = (*self._scene.contacts, *self.touching.contacts)
        return sum((self._of(one, seconds) for one in contacts), np.zeros(6))

    def _of(self, contact: Contact, seconds: float) -> Floats:
        """Each part of a contact pushes along the normal at its middle."""
        total, load = np.zeros(6), contact.load(seconds)
        if load is None:
            return total
        drag = [at(value, seconds) for value in contact.drag_n]
        torsion = at(contact.torsion_nm, seconds)
        for part, push in load.shares():
            point, normal, along, across = self._at(part.x_m, part.y_m)
            share = push / load.force_n
            force = -push * normal + share * (drag[0] * along + drag[1] * across)
            total += np.concatenate([force, np.cross(point, force) + share * torsion * normal])
        return total

    def _at(self, x_m: float, y_m: float) -> tuple[Floats, Floats, Floats, Floats]:
        x, y = x_m * self._wider + self._cells.sheet_m[0], y_m + self._cells.sheet_m[1]
        point, normal = (np.array(each) for each in self._surface.place(x, y))
        across = np.array(self._surface.place(x, y + 1.0)[0]) - point
        return point, normal, np.cross(across, normal), across

    def exact(self, seconds: float) -> Floats:
        """(n,): readings at a time, without noise, rounding and limits."""
        return self.exactly(self.wrench(seconds))

    def __call__(self, seconds: float) -> Sequence[int]:
        return self.under(self.wrench(seconds))
