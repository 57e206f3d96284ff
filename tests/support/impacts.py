"""Impacts on the cover, with the digits that were printed of them."""

from contactfpga.design.cover import Ball, elastic
from contactfpga.design.cover.arm import Arm

BASE = (0.6, 0.038, 0.15, 0.2)
SPEED = 0.4


def arm(**changes):
    return Arm.link(*BASE, **changes)


def spring(poisson=0.5, radius=0.019, modulus=3.65e5):
    return elastic.stiffness(Ball(radius, elastic.effective_modulus_pa(modulus, poisson)))


FIRST = spring()
ROWS = [
    (arm(), FIRST, 3.78018093, 8, 13.9076409, 7, 20.7882, 4),
    (arm(), spring(radius=0.038), 3.29084, 5, 12.10730, 5, 23.8793, 4),
    (arm(), spring(poisson=0.3), 4.08418, 5, 15.02607, 5, 19.2408, 4),
    (arm(torque_nm=2.0), FIRST, 5.72354651, 8, 16.0351470, 7, None, None),
    (arm(torque_nm=-1.0), FIRST, 2.93820403, 8, 12.1188771, 7, None, None),
    (arm(gravity=True), FIRST, 3.7726138, 7, 13.883912, 6, None, None),
    (arm(torque_nm=0.5, gravity=True, angle_rad=0.3), 1e5, 3.809761834, 9, 13.61037078, 8, 23.515095, 6),
]
"""Arm, stiffness, then compression in mm, time in ms and force in N, each with the digits printed."""
