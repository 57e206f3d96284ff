"""Where the tracker breaks: rates over placements, the same on other seeds, and where closed forms put them."""

import dataclasses
import functools
import itertools

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


def test_placements_are_others_for_each_number_and_seed():
    made = [breaks._lanes(8.0, rng) for rng in map(np.random.default_rng, (0, 1)) for _ in range(2)]
    assert len({one[0].time_us for one in made}) == 4
    assert len({tuple(tuple(zone.records.tolist()[0]) for zone in one[:40]) for one in made}) > 1


def test_fingers_of_the_breaks_close_the_switches_that_the_scenes_fingers_do(rng):
    for _ in range(50):
        x, y = rng.uniform(20, 500), rng.uniform(20, 140)
        finger = scenes.Finger(Contact(shape=disc(scenes.FINGER_MM), x_mm=x, y_mm=y))
        assert (breaks.under(np.array([x]), y)[0] == finger.cells(0.0, breaks.WIDE)).all()


PITCH_MM, RADIUS_MM, GATE_MM = 10.0, 8.0, 20.0
PLACEMENTS = 20_000


def middle(x, y):
    """Barycenters of the points of a square lattice within the radius of each place: (2, ...) of x and y."""
    near = PITCH_MM * np.arange(-1, 3)
    across = np.floor(x / PITCH_MM)[..., None] * PITCH_MM + near
    along = np.floor(y / PITCH_MM)[..., None] * PITCH_MM + near
    far = (across - x[..., None])[..., :, None] ** 2 + (along - y[..., None])[..., None, :] ** 2
    closed = far <= RADIUS_MM**2
    sums = (across[..., :, None] * closed).sum((-1, -2)), (along[..., None, :] * closed).sum((-1, -2))
    return np.stack(sums) / closed.sum((-1, -2))


def placed(rng, moves):
    """Barycenters of a finger that makes these moves, in mm, from random places: (2, placements, moves + 1)."""
    x, y = rng.uniform(0, PITCH_MM, (2, PLACEMENTS, 1))
    xs = x + np.concatenate([[0.0], np.cumsum(moves)])
    return middle(xs, np.broadcast_to(y, xs.shape))


def within(rng, moves, first=None):
    """In how many placements no barycenter lies beyond the gate of the one before; of the ``first`` ones, or all."""
    jumps = np.linalg.norm(np.diff(placed(rng, moves)), axis=0)[:, :first]
    return (jumps <= GATE_MM + 1e-6).all(axis=1).mean()


def speeding(step, count=10):
    return [step * (number + 1) / count for number in range(count)] + [step] * 9


def filtered(rng, ms):
    """In how many placements a Kalman filter of constant velocity, that a speed of 500 mm/s was given to at 500 frames
    per second, has the next barycenter within the gate of where it puts it after 50 ms."""
    dt, q, noise = 0.002, 4e6, PITCH_MM**2 / 12 * 0.003 / 0.002
    seen = placed(rng, [500 * dt] * 49 + [0.5 * ms])
    go = np.array([[1, dt], [0, 1]])
    spread = q * np.array([[dt**3 / 3, dt**2 / 2], [dt**2 / 2, dt]])
    known, state = np.diag([PITCH_MM**2 / 12, 1500.0**2]), np.stack([seen[..., 0], np.zeros_like(seen[..., 0])])
    for number in range(1, 50):
        known, state = go @ known @ go.T + spread, np.tensordot(go, state, 1)
        gain = known[:, 0] / (known[0, 0] + noise)
        state = state + gain[:, None, None] * (seen[..., number] - state[0])
        known = known - np.outer(gain, known[0])
    return (np.linalg.norm(seen[..., 50] - state[0] - 0.05 * state[1], axis=0) <= GATE_MM + 1e-6).mean()


def column_between(_, apart):
    """In how many placements two fingers in a row have an open column between them: chords at every height, and a
    lattice line in what lies between their ends."""
    height = np.linspace(-PITCH_MM / 2, PITCH_MM / 2, 4001)
    return np.clip((apart - 2 * np.sqrt(RADIUS_MM**2 - height**2)) / PITCH_MM, 0, 1).mean()


def row_between(rng, apart):
    """In how many placements no cell of one finger touches one of the other as they pass, at 1,000 frames a second."""
    x, y = PITCH_MM * np.arange(24), PITCH_MM * np.arange(-2, 12)
    free = 0
    for dx, dy, late in rng.uniform(0, [PITCH_MM, PITCH_MM, 1], (1000, 3)):
        now = np.arange(-16, 16) + late
        one, other = (
            (x[None, :, None] - 100 - dx - way * now[:, None, None]) ** 2 + (y - 40 - dy - way * apart / 2) ** 2
            <= RADIUS_MM**2
            for way in (-1, 1)
        )
        steps = itertools.product((-1, 0, 1), repeat=2)
        free += not any((np.roll(one, step, (1, 2)) & other).any() for step in steps)
    return free / 1000


SHARES = {
    ("slide", "nearest zone"): lambda rng, step: within(rng, speeding(step)),
    ("slide at once", "nearest zone"): lambda rng, step: within(rng, [step] * 9),
    ("slide at once", "`Tracker`"): lambda rng, step: within(rng, [step] * 9, 1),
    ("meet", "nearest zone"): column_between,
    ("cross", "nearest zone"): row_between,
    ("bounce", "`Tracker`, `hold_ms = 5`"): lambda _, ms: float(ms + 0.5 <= 5),
    ("bounce", "`Tracker`, `hold_ms = 20`"): lambda _, ms: float(ms + 0.5 <= 20),
    ("bounce", "nearest zone"): lambda _, ms: float(ms <= 0),
    ("lost", "nearest zone"): lambda rng, ms: within(rng, [0.5 * ms]),
    ("lost", "`Tracker`"): filtered,
}
"""The share of placements that are right, by arithmetic of its own, at a value of a knob."""

CLOSED = [(name, method) for name, knob in breaks.KNOBS.items() for method in knob.closed]


@pytest.mark.parametrize(("name", "method"), CLOSED)
def test_closed_forms_are_those_of_the_geometry(name, method):
    """The stated value is where the share falls below 95 %; half a percent of placements is chance."""
    knob = breaks.KNOBS[name]
    stated = knob.closed[method]
    step = 0.2 if knob.values[0] < knob.values[-1] else -0.2
    share = SHARES[name, method]
    assert share(np.random.default_rng(5), stated - step * (name != "bounce")) > 0.945
    assert share(np.random.default_rng(5), stated + 2 * step) < 0.955


@pytest.mark.parametrize(("name", "method"), CLOSED)
def test_the_page_breaks_where_closed_forms_say(name, method):
    """The last value that holds, and the first one that does not, lie on either side."""
    knob = breaks.KNOBS[name]
    cells = on_page()[f"{knob.title}: {knob.axis}", method]
    held, broken = float(cells[2].strip("*")), float(cells[4].partition(":")[0])
    stated = float(cells[5])
    assert min(held, broken) <= stated <= max(held, broken)
