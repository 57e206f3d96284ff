"""Device time in terms of the host's clock, as far as it was known when frames arrived."""

from __future__ import annotations

import dataclasses
from typing import TypeVar

import numpy as np

Times = TypeVar("Times", int, np.ndarray)


@dataclasses.dataclass(frozen=True, slots=True)
class HostLine:
    """A straight line from device time to the host's clock, and when the frames arrived that it is used for."""

    arrived_s: float
    """When their last bytes arrived."""
    base_us: int
    """A device time."""
    base_s: float
    """The host's clock at that moment."""
    rate: float
    """Seconds of the host's clock per second of device time."""
    sigma_s: float
    """Standard deviation of what :meth:`at` returns."""

    def at(self, time_us: Times) -> float | Times:
        """The host's clock in s at a device time in us, of frames that had arrived by :attr:`arrived_s`."""
        at_s = self.base_s + (time_us - self.base_us) * (self.rate * 1e-6)
        return np.minimum(at_s, self.arrived_s) if isinstance(at_s, np.ndarray) else min(at_s, self.arrived_s)
