"""Where force joined to location fails: the breaks that the page states, found again."""

import dataclasses
import functools

import numpy as np
import pytest
from sample import sample
from study_pages import section

from contactfpga.robot.haptics import Contact, Touch
from contactfpga_sim.lab.failures.tables import rows
from contactfpga_sim.lab.haptics import breaks
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
