"""Pressure units under the sheet of the arm: what they read of the touches, and the threshold that the board has."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from contactfpga.skin import Skin
from contactfpga.wire.command import Command, encode_command
from contactfpga.wire.units import UnitFacts, sum_threshold_value, zero_value
from contactfpga_sim.lab.arm.case import Case

THRESHOLD_N = 2.0
"""Of the whole push; noise of the sum is 0.09 N."""
GAIN_N = 0.02
"""Newtons per step of the converter."""
ZERO = 1000
SIGMA_N = 0.05
RING_MM = 75.0

FIRST_NUMBER = 129 * 128 + 1
"""Of a command; each of its two digits is above 0."""


class Under:
    """Three units at the corners of a triangle around the sheet's middle; the bumper weighs nothing."""

    def __init__(self, case: Case, skin: Skin):
        turn = np.radians([90, 210, 330])
        middle = [0.5 * (skin.columns - 1) * skin.pitch_x_mm, 0.5 * (skin.rows - 1) * skin.pitch_y_mm]
        places = np.stack([middle[0] + RING_MM * np.cos(turn), middle[1] + RING_MM * np.sin(turn), np.ones(3)])
        touches = np.array([[touch.x_mm, touch.y_mm, 1.0] for touch in case.touch]).T
        self._shares = np.linalg.solve(places, touches) / GAIN_N
        self._rng = np.random.default_rng(0)
        self._skin = skin

    def readings(self, forces_n: Sequence[float]) -> list[int]:
        """Of all units, while the touches push like this."""
        loads = self._shares @ np.maximum(forces_n, 0.0) + SIGMA_N / GAIN_N * self._rng.standard_normal(3)
        found: list[int] = np.clip(np.rint(ZERO + loads), 0, 4095).astype(int).tolist()
        return found

    def commands(self) -> bytes:
        """Zeros, and the threshold of the plain sum."""
        derived = self._skin.derived
        facts = UnitFacts.of(derived.units)
        wanted = [zero_value(facts, unit, ZERO) for unit in range(3)]
        wanted.append(sum_threshold_value(facts, 0, round(THRESHOLD_N / GAIN_N)))
        numbered = enumerate(wanted, FIRST_NUMBER)
        return b"".join(encode_command(number, Command(*one), pulsed=derived.pulsed) for number, one in numbered)
