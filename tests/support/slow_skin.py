"""A small board that holds real time on a busy machine: one for several tests, as each has to be compiled."""

from contactfpga.skin import Skin

SLOW = Skin(rows=4, columns=4, clock_hz=3_000_000, baud=750_000, settle_us=100.0)
