"""Disturbances of the soft kit's film. No other test kills a limit that is not the least one that fails, a cell that
its own preload presses, and a level that does not follow its column's capacitor."""

import dataclasses
import math

import numpy as np
import pytest

from contactfpga_sim.lab.kits import breaks
from contactfpga_sim.lab.kits.breaks import CELL, CIRCUIT, DISTURBANCES, SKIN, Film
from contactfpga_sim.lab.kits.film import LevelReader

REST = np.zeros((SKIN.rows, SKIN.columns))


def test_the_limit_is_the_least_value_that_fails():
    knob = DISTURBANCES["leakage of the pins"]
    for limit in (knob.tried[0], 1.0, 7.0, knob.tried[1]):
        found = knob.first(lambda value, limit=limit: value >= limit * (1 - 1e-9))
        step = (knob.tried[1] / knob.tried[0]) ** (1 / (breaks.VALUES - 1))
        assert limit * (1 - 1e-6) <= found < limit * step
    assert knob.first(lambda value: False) is None


def test_levels_are_those_of_the_compiled_board():
    """Resistances at least 0.1 octaves from any level, which is more than whole clocks add."""
    edges = np.log2(Film().read_ohm()[:, 0])
    ohm = 2 ** np.random.default_rng(3).uniform(edges.min() - 3, edges.max() + 3, REST.shape)
    far = np.abs(np.log2(ohm) - edges[:, None, None]).min(axis=0) > 0.1
    want = (ohm[..., None] <= Film().read_ohm()[:, 0]).sum(axis=-1)
    assert (LevelReader(SKIN).read(ohm, CIRCUIT)[far] == want[far]).all()
    assert set(want[far].flat) == {0, 1, 2, 3}


def test_nothing_reads_pressed_at_rest_but_by_what_came_later():
    """A cover that presses five times as hard is masked; leakage that was not there at rest is not."""
    rng, heavy = np.random.default_rng(4), Film(dataclasses.replace(CELL, preload_n=0.1))
    assert not any(film.levels(REST, rng).any() for film in (Film(), heavy) for _ in range(20))
    assert any(DISTURBANCES["leakage of the pins"].film(10.0).levels(REST, rng).any() for _ in range(5))


def test_a_level_follows_its_columns_capacitor():
    """The fall's time goes as all of the column's picofarads, here beside an opposite ruler."""
    share = 0.1 * 220 / (220 + CIRCUIT.line_pf + SKIN.row_lines * CIRCUIT.crossing_pf + 2 * CIRCUIT.neighbor_pf)
    want = math.log2((1 + share) / (1 - share))
    assert DISTURBANCES["capacitors, off by"].off(10.0) == pytest.approx(want, rel=0.15)


def test_a_finger_is_one_contact():
    assert all(breaks._touch(Film(), np.random.default_rng(seed)).right for seed in range(5))
