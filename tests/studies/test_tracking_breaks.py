"""Where the tracker breaks: rates over placements, the same on other seeds, and where closed forms put them."""

import dataclasses
import functools

import numpy as np
import pytest
from sample import sample
from study_pages import section

from contactfpga_sim.apps import stats
from contactfpga_sim.lab import knobs, writer
from contactfpga_sim.lab.tracking import breaks, scenes, tables
from contactfpga_sim.model.scenes.contacts import Contact, disc

QUICK = ["slide at once", "bounce"]


def on_page():
    """The cells of each row of the page's table, by the knob's first cell and the method."""
    found, first = {}, ""
    for line in section("tracking.md", "breaks").splitlines()[2:]:
        cells = line[2:-2].split(" | ")
        first = cells[0] or first
        found[first, cells[1]] = cells
    return found


@functools.cache
def swept(name, seed):
    """The outcomes of a knob; the page's seeds are as they stand, others have a number more."""
    knob = breaks.KNOBS[name]
    runs = {
        method: dataclasses.replace(run, seed=(run.seed, seed)) if seed else run for method, run in knob.runs.items()
    }
    return dataclasses.replace(knob, runs=runs).sweep()


@pytest.mark.slow  # 10 s
@pytest.mark.parametrize("name", sample(breaks.KNOBS, QUICK))
def test_the_breaks_are_up_to_date(name):
    lines = section("tracking.md", "breaks").splitlines()
    for row in tables.break_rows(breaks.KNOBS[name], swept(name, 0)):
        assert writer.line(row) in lines


@pytest.mark.slow
@pytest.mark.parametrize("name", sample(breaks.KNOBS, QUICK[:1]))
def test_two_other_seeds_break_there_or_a_step_beside(name):
    found = [swept(name, seed) for seed in (0, 1, 2)]
    for method in breaks.KNOBS[name].runs:
        steps = [len(one[method].values) if one[method].broken is None else one[method].broken for one in found]
        assert max(steps) - min(steps) <= 1


@pytest.mark.parametrize(
    ("right", "of", "reaches"), [(120, 120, True), (30, 30, None), (110, 120, None), (100, 120, False), (0, 30, False)]
)
def test_a_rate_reaches_a_level_where_wilsons_interval_does(right, of, reaches):
    """By the roots of (p - right / of)^2 = z^2 p (1 - p) / of."""
    rate, share, odds = stats.Rate(right, of), right / of, knobs.Z**2 / of
    low, high = sorted(np.roots([1 + odds, -2 * share - odds, share**2]).real)
    assert rate.interval(knobs.Z) == pytest.approx((low, high), abs=1e-6)
    assert rate.reaches(knobs.LEVEL, knobs.Z) is reaches
    assert {True: low >= 0.95, False: high < 0.95, None: low < 0.95 <= high}[reaches]


def test_fingers_of_the_breaks_close_the_switches_that_the_scenes_fingers_do(rng):
    for _ in range(50):
        x, y = rng.uniform(20, 500), rng.uniform(20, 140)
        finger = scenes.Finger(Contact(shape=disc(scenes.FINGER_MM), x_mm=x, y_mm=y))
        assert (breaks.under(np.array([x]), y)[0] == finger.cells(0.0, breaks.WIDE)).all()


CLOSED = [(name, method) for name, knob in breaks.KNOBS.items() for method in knob.closed]


@pytest.mark.parametrize(("name", "method"), CLOSED)
def test_the_page_breaks_where_closed_forms_say(name, method):
    """The last value that holds, and the first one that does not, lie on either side."""
    knob = breaks.KNOBS[name]
    cells = on_page()[f"{knob.title}: {knob.axis}", method]
    held, broken = float(cells[2].strip("*")), float(cells[4].partition(":")[0])
    stated = float(cells[5])
    assert min(held, broken) <= stated <= max(held, broken)
