"""The least error that a method can have: against closed forms, integrals of its own, other seeds and methods."""

import math

import numpy as np
import pytest
from scipy.optimize import minimize

from contactfpga.skin import Skin
from contactfpga.zones import labels
from contactfpga.zones.zone import Zone
from contactfpga_sim.lab.chart import errors
from contactfpga_sim.lab.chart.floor import floor, inner, place_table
from contactfpga_sim.lab.covers import tiled

TEN = Skin(pitch_x_mm=10.0, pitch_y_mm=10.0)
FINGER = {"half_mm": (7.0, 7.0), "ratio": (1.0, 1.0)}
"""A round one of known size."""


def sigma(interval):
    """Standard deviation of a mean."""
    return (interval.high - interval.low) / 2 / errors.Z95


def test_a_point_on_one_tile_lies_nowhere_better_than_in_its_middle():
    """Mean distance in a square from its middle: side (sqrt 2 + ln(1 + sqrt 2)) / 6."""
    want = 10 * (math.sqrt(2) + math.log(1 + math.sqrt(2))) / 6
    assert want == pytest.approx(3.826, abs=1e-3)
    got = floor("finger", TEN, tiled(10.0), 1000, 1, half_mm=(0.01, 0.01), ratio=(1.0, 1.0))
    assert got.felt.mean == 1
    for one in (got.lower_mm, got.upper_mm, got.barycenter_mm, got.table_mm):
        assert one.mean == pytest.approx(want, abs=3 * sigma(one))
    assert got.lower_mm.mean == pytest.approx(got.upper_mm.mean, rel=1e-3)


def bare_floor_mm(radius, pitch, steps=90):
    """Mean distance from the geometric median, by a grid of places: discs that cover the same switches, whose middle
    lies in one cell of four switches."""
    at = ((np.arange(3 * steps) + 0.5) / steps - 1) * pitch
    x, y = (axis.ravel() for axis in np.meshgrid(at, at))
    switches = np.array([(i, j) for i in range(-4, 6) for j in range(-4, 6)]) * pitch
    covered = np.hypot(x[:, None] - switches[:, 0], y[:, None] - switches[:, 1]) <= radius
    patterns, number = np.unique(covered, axis=0, return_inverse=True)
    distance = count = 0
    for one, pattern in enumerate(patterns):
        middle = switches[pattern].mean(axis=0) if pattern.any() else (-1, -1)
        if min(middle) >= 0 and max(middle) < pitch:
            same = np.column_stack([x, y])[number.ravel() == one]
            distance += minimize(lambda place, same=same: np.hypot(*(same - place).T).sum(), same.mean(axis=0)).fun
            count += len(same)
    assert 0.7 * steps**2 < count <= 1.001 * steps**2
    return distance / count


@pytest.mark.parametrize("radius", [7.0, 10.0])
def test_the_floor_of_a_disc_of_known_size_is_that_of_an_integral(radius):
    want = bare_floor_mm(radius, 10.0)
    away = []
    for seed in range(4):
        got = floor("finger", TEN, None, 500, seed, half_mm=(radius, radius), ratio=(1.0, 1.0))
        assert got.lower_mm.mean <= got.upper_mm.mean < 1.01 * got.lower_mm.mean
        away.append((got.upper_mm.mean - want) / sigma(got.upper_mm))
    assert abs(sum(away)) < 3 * math.sqrt(len(away))


@pytest.mark.parametrize("pitch", [6.4, 10.0])
def test_no_method_lies_below_the_floor_but_one_that_cheats(pitch):
    skin, cover = Skin(pitch_x_mm=pitch, pitch_y_mm=pitch), tiled(pitch)
    got = floor("finger", skin, cover, 800, 7)
    sheet, scenes = inner("finger", skin, None, 800, 7)
    looks = [(scene, cells) for scene in scenes if (cells := scene.pressed(0.0, sheet, cover)).any()]
    for settings in (
        {},
        {"labeller": "projection"},
        {"labeller": "single"},
        {"report": "barycenter", "barycenter_bits": 1},
    ):
        method = sheet.replace(**settings)
        far = errors.interval(
            [
                errors.errors(errors.method_zones(cells, method), errors.contacts(scene.truth(0.0))).barycenter_mm
                for scene, cells in looks
            ]
        )
        assert far.mean > got.lower_mm.mean - 1e-9, settings
        assert far.mean > got.upper_mm.mean - 3 * sigma(far), settings
    assert got.table_mm.mean > got.lower_mm.mean
    cheat = [0.5 * math.dist(_middle(cells, pitch), _place(scene)) for scene, cells in looks]
    assert np.mean(cheat) < got.lower_mm.mean - 3 * sigma(got.lower_mm)


def _middle(cells, pitch):
    return np.argwhere(cells)[:, ::-1].mean(axis=0) * pitch


def _place(scene):
    contact = scene.truth(0.0).contacts[0]
    return contact.x_mm, contact.y_mm


def zones_of(cells, pitch):
    """Zones as the host makes them of cells."""
    return [
        Zone(int(a), int(x), int(y), a * pitch**2, x / a * pitch, y / a * pitch, None, None)
        for a, x, y in labels.moments(labels.label(cells, 8)).tolist()
    ]


def test_a_table_of_other_scenes_reaches_the_floor_where_the_size_is_known():
    cover = tiled(10.0)
    table = place_table("finger", TEN, cover, 800, 8, **FINGER)
    sheet, scenes = inner("finger", TEN, None, 800, 9, **FINGER)
    by_table, by_barycenter = [], []
    for scene in scenes:
        (zone,) = zones_of(scene.pressed(0.0, sheet, cover), 10.0)
        by_table.append(math.dist(table.place_mm(zone), _place(scene)))
        by_barycenter.append(math.dist((zone.x_mm, zone.y_mm), _place(scene)))
    least = floor("finger", TEN, cover, 800, 9, **FINGER)
    assert np.mean(by_table) <= 1.05 * least.lower_mm.mean
    assert np.mean(by_table) < 0.92 * np.mean(by_barycenter)
    assert np.mean(by_barycenter) == pytest.approx(least.barycenter_mm.mean)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: floor("pair", TEN, None, 5, 0), "family 'pair' has no floor here; take one of finger, bumper"),
        (
            lambda: floor("finger", Skin(pitch_x_mm=60.0, pitch_y_mm=60.0), None, 1, 0, half_mm=(0.1, 0.1)),
            "none of the 1 scenes closes a switch",
        ),
    ],
)
def test_what_has_no_floor_is_refused(call, message):
    with pytest.raises(ValueError, match=message):
        call()
