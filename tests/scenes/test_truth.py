"""What touches: number, area and barycenter of contacts, against closed forms and against a fine raster."""

import itertools
import math

import numpy as np
import pytest
from scipy import ndimage

from contactfpga.design.cover import Ellipse, Rectangle
from contactfpga_sim.model.scenes.truth import TOUCH_M, Box, truth_of

CM = 0.01


def assert_contacts(truth, *expected):
    """Contacts as (area in mm2, x and y in mm), in their order, to 1e-7 of the area and of 1 mm."""
    assert truth.count == len(expected)
    for contact, (area, x, y) in zip(truth.contacts, expected, strict=True):
        assert contact.area_mm2 == pytest.approx(area, rel=1e-7)
        assert (contact.x_mm, contact.y_mm) == pytest.approx((x, y), abs=1e-7)


def test_one_part_is_its_own_closed_form():
    assert_contacts(truth_of([Ellipse(CM, CM)]), (100 * math.pi, 0, 0))
    assert_contacts(truth_of([Ellipse(0.02, 0.005, 0.03, -0.01, 0.7)]), (100 * math.pi, 30, -10))
    assert_contacts(truth_of([Rectangle(0.02, 0.005, 0.03, -0.01, 0.7)]), (400, 30, -10))
    assert_contacts(truth_of([]))


@pytest.mark.parametrize("make", [Ellipse, Rectangle])
@pytest.mark.parametrize("angle", [0.0, 0.3, math.pi / 2, 2.0])
def test_the_same_part_twice_is_measured_like_one(make, angle):
    # Two parts in one place take the way over the rows.
    part = make(0.02, 0.005, 0.03, -0.01, angle)
    inner = make(0.01, 0.004, 0.03, -0.01, angle)
    for parts in ([part, part], [part, inner], [inner, part]):
        assert_contacts(truth_of(parts), (part.area_m2 * 1e6, 30, -10))


def lens(radius, apart):
    """Area that two discs have in common."""
    return 2 * radius**2 * math.acos(apart / 2 / radius) - apart / 2 * math.sqrt(4 * radius**2 - apart**2)


@pytest.mark.parametrize("angle", [0.0, 0.4, math.pi / 2])
@pytest.mark.parametrize("apart", [0.1, 5.0, 12.0, 19.9, 19.999])
def test_two_discs_that_overlap_are_one(angle, apart):
    x, y = apart * math.cos(angle), apart * math.sin(angle)
    two = [Ellipse(CM, CM), Ellipse(CM, CM, x * 1e-3, y * 1e-3)]
    area = 200 * math.pi - lens(10, apart)
    assert_contacts(truth_of(two), (area, x / 2, y / 2))


@pytest.mark.parametrize("angle", np.linspace(0, math.pi, 13))
def test_two_discs_part_where_their_rims_do(angle):
    for gap, count in ((1e-6, 2), (3 * TOUCH_M, 2), (0.0, 1), (-1e-6, 1)):
        apart = 2 * CM + gap
        two = [Ellipse(CM, CM, 0.1, 0.2), Ellipse(CM, CM, 0.1 + apart * math.cos(angle), 0.2 + apart * math.sin(angle))]
        assert truth_of(two).count == count, gap


def test_parts_are_joined_through_others_in_any_order():
    chain = [Ellipse(CM, CM, x, 0.0) for x in (0, 0.015, 0.03, 0.045)] + [Ellipse(CM, CM, 0.2, 0.0)]
    expected = truth_of(chain)
    assert [round(contact.x_mm, 6) for contact in expected.contacts] == [22.5, 200]
    for order in itertools.permutations(chain):
        assert_contacts(truth_of(order), *expected.contacts)


def test_contacts_come_by_y_then_x():
    places = [(0.05, 0.02), (0.01, 0.02), (0.03, 0.0)]
    truth = truth_of([Ellipse(0.001, 0.001, x, y) for x, y in places])
    assert [(round(one.x_mm), round(one.y_mm)) for one in truth.contacts] == [(30, 0), (10, 20), (50, 20)]
    assert truth.area_mm2 == pytest.approx(3 * math.pi)


def test_a_ring_has_its_hole():
    bars = [(0.03, 0.005, 0, 0.025), (0.03, 0.005, 0, -0.025), (0.005, 0.03, 0.025, 0), (0.005, 0.03, -0.025, 0)]
    assert_contacts(truth_of([Rectangle(*bar) for bar in bars]), (60 * 60 - 40 * 40, 0, 0))
    assert_contacts(truth_of([Rectangle(*bar).placed(0.1, 0.2, 0.6) for bar in bars]), (2000, 100, 200))


def test_what_lies_beside_the_sheet_does_not_count():
    box = Box(0.0, 0.1, 0.0, 0.1)
    third = 4 * 10 / (3 * math.pi)
    assert_contacts(truth_of([Ellipse(CM, CM, 0.0, 0.05)], box), (50 * math.pi, third, 50))
    assert_contacts(truth_of([Ellipse(CM, CM, 0.1, 0.1)], box), (25 * math.pi, 100 - third, 100 - third))
    assert_contacts(truth_of([Ellipse(CM, CM, -0.02, 0.05), Ellipse(CM, CM, 0.111, 0.05)], box))
    assert_contacts(truth_of([Rectangle(0.5, 0.01, 0.05, 0.05)], box), (2000, 50, 50))
    # Joined outside of the sheet only: on it they are two.
    fork = [Rectangle(0.02, 0.002, 0.0, 0.04), Rectangle(0.02, 0.002, 0.0, 0.06), Rectangle(0.002, 0.02, -0.01, 0.05)]
    assert truth_of(fork).count == 1
    assert_contacts(truth_of(fork, box), (80, 10, 40), (80, 10, 60))


def random_parts(rng):
    """Up to five parts, some of them long and thin, around one place."""
    return [
        (Ellipse if rng.random() < 0.6 else Rectangle)(
            *rng.uniform(0.002, 0.02, 2), *rng.uniform(0.0, 0.06, 2), rng.uniform(0, 2 * math.pi)
        )
        for _ in range(rng.integers(1, 6))
    ]


def own_test(part, x, y):
    """Whether points lie in a part, from its fields alone."""
    turn = np.exp(-1j * part.angle_rad)
    own = ((x - part.x_m) + 1j * (y - part.y_m)) * turn
    if isinstance(part, Ellipse):
        return (own.real / part.half_x_m) ** 2 + (own.imag / part.half_y_m) ** 2 <= 1
    return (abs(own.real) <= part.half_x_m) & (abs(own.imag) <= part.half_y_m)


def test_random_scenes_against_a_raster(record_property):
    step = 5e-5
    box = Box(0.0, 0.05, 0.005, 0.055)
    x = np.arange(box.left + step / 2, box.right, step)
    y = np.arange(box.top + step / 2, box.bottom, step)[:, None]
    compared = 0
    for seed in range(25):
        parts = random_parts(np.random.default_rng(seed))
        cells = np.any([own_test(part, x, y) for part in parts], axis=0)
        labels, count = ndimage.label(cells, np.ones((3, 3)))
        # Where the raster cannot tell whether two contacts touch, only the total counts.
        wider = ndimage.label(ndimage.binary_dilation(cells, np.ones((3, 3))), np.ones((3, 3)))[1]
        narrower = ndimage.label(ndimage.binary_erosion(cells, np.ones((3, 3))), np.ones((3, 3)))[1]
        truth = truth_of(parts, box)
        assert truth.area_mm2 == pytest.approx(cells.sum() * step**2 * 1e6, rel=2e-3, abs=0.05)
        if not count == wider == narrower:
            continue
        compared += 1
        assert truth.count == count, seed
        found = sorted(
            (float(np.mean(x[column]) * 1e3), float(np.mean(y[row, 0]) * 1e3), len(row) * step**2 * 1e6)
            for row, column in (np.nonzero(labels == label) for label in range(1, count + 1))
        )
        expected = sorted((one.x_mm, one.y_mm, one.area_mm2) for one in truth.contacts)
        for got, want in zip(found, expected, strict=True):
            assert got[:2] == pytest.approx(want[:2], abs=0.05)
            assert got[2] == pytest.approx(want[2], rel=5e-3, abs=0.05)
    assert compared > 20
    record_property("cases", compared)


@pytest.mark.parametrize("make", [Ellipse, Rectangle])
def test_spans_are_where_parts_contain_points(make):
    rng = np.random.default_rng(4)
    for angle in (0.0, math.pi / 2, 0.1, 2.5, *rng.uniform(0, 6, 5)):
        part = make(0.02, 0.005, 0.001, 0.002, angle)
        half_x, half_y = part.half_box_m
        y = part.y_m + np.linspace(-1.2, 1.2, 241) * half_y
        x = part.x_m + np.linspace(-1.2, 1.2, 1201) * half_x
        left, right = part.span(y)
        inside = own_test(part, x, y[:, None])
        away = 1e-9
        assert np.array_equal(inside, part.contains(x, y[:, None]))
        assert not (inside & (x < left[:, None] - away)).any()
        assert not (inside & (x > right[:, None] + away)).any()
        assert inside[(x > left[:, None] + away) & (x < right[:, None] - away)].all()
        off = np.abs(y - part.y_m) - half_y
        assert np.array_equal(np.isfinite(left)[np.abs(off) > 1e-12], (off < 0)[np.abs(off) > 1e-12])
        assert np.abs(x[inside.any(axis=0)] - part.x_m).max() == pytest.approx(half_x, rel=5e-3)
