"""Where force joined to location fails: the breaks that the page states, found again; and end to end."""

import dataclasses
import functools

import numpy as np
import pytest
from sample import sample
from study_pages import section

from contactfpga.robot.haptics import Contact, Plane, Touch
from contactfpga_sim.lab.failures.tables import rows
from contactfpga_sim.lab.haptics import breaks, felt, tables
from contactfpga_sim.lab.haptics.breaks import KNOBS
from contactfpga_sim.lab.knobs import Sweep

ALL = [(name, method) for name, knob in KNOBS.items() for method in knob.runs]
QUICK = [
    ("unseen", "force at the zone"),
    ("torsion", "center of pressure"),
    ("clipping", "center of pressure"),
    ("friction", "estimate, 1 N"),
]


def on_page(name):
    """The lines of a knob in the page's table."""
    table = section("haptics_limits.md", "breaks").splitlines()[2:]
    starts = [at for at, line in enumerate(table) if not line.startswith("|  |")] + [len(table)]
    first = next(at for at in starts if table[at].startswith(f"| {KNOBS[name].title}: "))
    return table[first : starts[starts.index(first) + 1]]


@functools.cache
def swept(name, method, seed):
    """All values of a knob; the page's seed is 0."""
    knob = KNOBS[name]
    assert knob.runs[method].seed == 0
    return Sweep(knob.values, tuple(map(dataclasses.replace(knob.runs[method], seed=seed), knob.values)))


@pytest.mark.slow
@pytest.mark.parametrize(("name", "method"), sample(ALL, QUICK))
def test_each_break_is_where_the_page_says(name, method):
    knob = KNOBS[name]
    line = list(rows(knob, {method: swept(name, method, 0)})[0][2:7])
    (stated,) = [one.split(" | ")[2:7] for one in on_page(name) if one.split(" | ")[1] == method]
    assert line == stated


@pytest.mark.slow
@pytest.mark.parametrize(("name", "method"), sample(ALL, QUICK[:1]))
def test_two_other_seeds_break_there_or_a_step_beside(name, method):
    broken = [swept(name, method, seed).broken for seed in (0, 1, 2)]
    places = [len(KNOBS[name].values) if place is None else place for place in broken]
    assert max(places) - min(places) <= 1


def test_what_nothing_disturbs_is_as_stated():
    """A covariance that is too small or too large by a tenth would show."""
    trials = breaks.force(breaks.Disturbance(), np.random.default_rng(1), 300)
    assert 0.91 < np.mean([trial.right for trial in trials]) < 0.99


def test_an_interval_holds_its_ends_and_nothing_beyond():
    """The study's criterion adds nothing to either end."""
    touch = Touch((0.0, 0.0, 0.0), (0.0, 0.0, 1.0))
    one = Contact(touch, (0.0, 0.0, -2.0), 2.0, "", lambda: [(1.0, 3.0)])
    assert [breaks.holds(one, push) for push in (1.0, 3.0)] == [True, True]
    assert [breaks.holds(one, push) for push in (1.0 - 1e-9, 3.0 + 1e-9)] == [False, False]
    assert breaks.holds(Contact(touch, (0.0, 0.0, -2.0), 2.0, "", lambda: [(1.0, None)]), 1e6)


@pytest.mark.campaign
@pytest.mark.parametrize("setting", felt.SETTINGS[1:2])
def test_a_place_asked_once_is_that_of_asking_again_and_again(setting):
    """So that the campaign may ask at the end alone, which takes half the time."""
    last = felt.errors(setting, 3, felt.TIMES_S[-1:])
    assert {method: [errors[-1]] for method, errors in felt.errors(setting, 3).items()} == last


PLACEMENTS = 334
"""Of each of three tests, which makes 1,000 in all; each takes a minute."""


@pytest.mark.campaign
@pytest.mark.timeout(1200)
@pytest.mark.parametrize(("setting", "most_mm"), list(zip(felt.SETTINGS[1:], (0.15, 0.4))))
def test_closings_of_many_placements_end_to_end(setting, most_mm):
    """At 5 mm, with as many switches as close: 0.15 mm without noise, 0.4 mm with it."""
    errors = tables.found(setting, PLACEMENTS, felt.TIMES_S[-1:])
    assert tables.interval(errors["closings"][:, -1])[2] <= 1e-3 * most_mm


@pytest.mark.campaign
@pytest.mark.timeout(1200)
def test_centers_of_pressure_of_many_placements_end_to_end():
    """As far off as their covariance predicts. Between two samples, at a share s, noise is sqrt(s^2 + (1 - s)^2) of a
    sample's, which is sqrt(2 / 3) on average."""
    setting = felt.SETTINGS[0]
    errors = tables.found(setting, PLACEMENTS, felt.TIMES_S[-1:])["center of pressure"][:, -1]
    push = np.array([0, 0, -felt.MOST_N, 0, 0, 0])
    predicted = Plane().center(setting.cells.wrench(setting.cells.zeros + np.linalg.pinv(setting.cells.matrix) @ push))
    expected = np.sqrt(2 / 3 * np.trace(predicted.covariance_m2))
    assert tables.interval(errors)[0] == pytest.approx(expected, rel=0.1)


@pytest.mark.campaign  # which has a board of its own to compile
def test_two_contacts_60_mm_apart_are_felt_apart():
    found = felt.two(60.0, 0)
    assert found.zones == 2
    assert np.sqrt(np.mean(np.square(found.off_n))) < 1.2  # 0.6 N over many
