"""Force and moment on the link, with their noise: what all units together measure."""

from __future__ import annotations

import dataclasses
import functools

import numpy as np

from contactfpga.robot.haptics.answer import Floats, HapticsError, Vector

ALARM = (10.828, 13.816, 16.266, 18.467, 20.515, 22.458)
"""Chi-square that chance exceeds once in a thousand times, with 1 to 6 degrees of freedom."""

Block = tuple[Vector, ...]


class Noise:
    """The covariance of a wrench, and what follows from it; one object serves all wrenches of the same units."""

    def __init__(self, covariance: Floats):
        self.covariance = covariance
        """(6, 6): N2, Nm2 and N Nm; about the link's origin."""

    @classmethod
    def checked(cls, covariance: Floats) -> Noise | None:
        """The noise of a covariance from outside; None where all of it is 0, which says nothing. Raises
        :class:`HapticsError` for what is no covariance."""
        if not covariance.any():
            return None
        size = np.sqrt(np.abs(np.diag(covariance)))
        scale = np.outer(size, size)
        if (np.diag(covariance) < 0).any() or (np.abs(covariance) > scale * (1 + 1e-6)).any():
            raise HapticsError("covariance is no covariance: an entry exceeds what its variances allow")
        if not np.allclose(covariance, covariance.T, rtol=0, atol=1e-6 * scale.max()):
            raise HapticsError("covariance is not symmetric; entry [i][j] must equal entry [j][i]")
        made = cls((covariance + covariance.T) / 2)
        if made._spectrum[0][0] < -1e-6:
            raise HapticsError("covariance is no covariance: along some direction its variance is below 0")
        return made

    @functools.cached_property
    def _spectrum(self) -> tuple[Floats, Floats, Floats]:
        """Eigenvalues and vectors of the correlations, and the standard deviations they are scaled by."""
        size = np.sqrt(np.diag(self.covariance))
        size = np.where(size > 1e-9 * size.max(), size, 0.0)
        over = np.where(size > 0, 1 / np.where(size > 0, size, 1.0), 0.0)
        values, vectors = np.linalg.eigh(self.covariance * np.outer(over, over))
        return values, vectors, over

    @functools.cached_property
    def blocks(self) -> tuple[Block, Block, Block]:
        """Covariances force by force, force by moment, moment by moment, in plain numbers."""
        parts = (self.covariance[:3, :3], self.covariance[:3, 3:], self.covariance[3:, 3:])
        force, both, moment = (tuple(map(tuple, part.tolist())) for part in parts)
        return force, both, moment

    @functools.cached_property
    def information(self) -> Floats:
        """(6, 6): the inverse of the covariance. A component without noise is one that the units do not see, so it
        counts for nothing."""
        return np.asarray(self.root.T @ self.root)

    @functools.cached_property
    def root(self) -> Floats:
        """(rank, 6): transposed times itself it is the information."""
        values, vectors, over = self._spectrum
        seen = values > 1e-9 * values[-1]
        return np.asarray((vectors[:, seen] / np.sqrt(values[seen])).T * over)

    def widened(self, moments: Floats) -> Noise:
        """The same noise with ``moments``, (3, 3) in N2m2, added to the covariance of the moments that units see."""
        more = np.zeros((6, 6))
        more[3:, 3:] = moments
        if self.rank < 6:
            values, vectors, over = self._spectrum
            seen = vectors[:, values > 1e-9 * values[-1]]
            kept = np.sqrt(np.diag(self.covariance))[:, None] * (seen @ seen.T) * over
            more = kept @ more @ kept.T
        return Noise(self.covariance + more)

    @functools.cached_property
    def rank(self) -> int:
        """Independent components that the units see: 6 where they see all."""
        values = self._spectrum[0]
        return int((values > 1e-9 * values[-1]).sum())


@dataclasses.dataclass(frozen=True, slots=True)
class Wrench:
    """What the contacts together exert on the link."""

    force_n: Vector
    moment_nm: Vector
    """About the origin of the link's frame."""
    noise: Noise | None = None
    """None where it is not known."""
    frame: str = ""
    """Name of the link's frame."""
    saturated: tuple[int, ...] = ()
    """Numbers of the units at an end of their range: the wrench is wrong by an unknown amount."""
    lifted: tuple[int, ...] = ()
    """Numbers of the units that nothing presses any more: they would have to pull."""

    @property
    def covariance(self) -> Floats | None:
        """(6, 6), as :class:`Noise` has it."""
        return None if self.noise is None else self.noise.covariance

    @property
    def array(self) -> Floats:
        """Force in N and moment in Nm, (6,)."""
        return np.array((*self.force_n, *self.moment_nm))


@dataclasses.dataclass(frozen=True)
class Motion:
    """How the link moves, in its own frame, for the force that carries the bumper along."""

    gravity_m_s2: Vector = (0.0, 0.0, -9.80665)
    """Which way things fall, in the link's frame."""
    acceleration_m_s2: Vector = (0.0, 0.0, 0.0)
    """Of the frame's origin, without gravity."""
    turning_rad_s: Vector = (0.0, 0.0, 0.0)
    """Angular velocity."""
    turning_rad_s2: Vector = (0.0, 0.0, 0.0)
    """Angular acceleration."""


@dataclasses.dataclass(frozen=True)
class Bumper:
    """The mass that the units carry."""

    mass_kg: float
    center_m: Vector
    """Its center of mass in the link's frame."""
    inertia_kg_m2: tuple[Vector, Vector, Vector] = ((0.0, 0.0, 0.0),) * 3
    """About its center of mass."""

    def wrench(self, motion: Motion) -> Floats:
        """The wrench (6,) in N and Nm that the units must exert on the bumper to move it with the link."""
        center, inertia = np.array(self.center_m), np.array(self.inertia_kg_m2)
        spin, more = np.array(motion.turning_rad_s), np.array(motion.turning_rad_s2)
        felt = np.array(motion.acceleration_m_s2) - np.array(motion.gravity_m_s2)
        felt = felt + np.cross(more, center) + np.cross(spin, np.cross(spin, center))
        force = self.mass_kg * felt
        moment = inertia @ more + np.cross(spin, inertia @ spin) + np.cross(center, force)
        return np.concatenate([force, moment])
