"""Where methods fail: each break where the page says, found again by turning, and nothing wrong unnoticed but what is
listed here."""

import dataclasses
import functools
import math
import re
from pathlib import Path

import numpy as np
import pytest
from sample import sample
from scipy import ndimage
from scipy.stats import fisher_exact
from study_pages import outdated, section

from contactfpga.skin import Skin
from contactfpga_sim.apps import stats
from contactfpga_sim.lab import knobs, writer
from contactfpga_sim.lab.failures import electric, line, tables, touch
from contactfpga_sim.lab.failures.catalogue import KNOBS
from contactfpga_sim.lab.failures.line import Line
from contactfpga_sim.lab.knobs import Knob, Outcome, Sweep

pytestmark = pytest.mark.timeout(1200)  # boards may have to be built

PAGE = Path(__file__).resolve().parents[2] / "docs" / "failures.md"

METHODS = [(name, method) for name, knob in KNOBS.items() for method in knob.runs]

TOLD = {
    ("capacity", "any labeller"): {"overflow"},
    ("settle", "4.7 kΩ pull-up, `release_us = 1`"): {"stuck"},
    ("settle", "40 kΩ pull-up, the same"): {"stuck", "motion"},
    ("settle", "the same with guard lines"): {"row N open", "guard row open", "all lines open"},
    ("settle_reversal", "4.7 kΩ pull-up"): {"motion"},
    ("settle_reversal", "the same with guard lines"): {"motion", "guard row open"},
    ("project_reversal", "the same with guard lines"): {"guard column open", "all lines open"},
    ("broken", "row, with guard lines"): {"row N open"},
    ("broken", "column, with guard lines"): {"column N open"},
    ("broken_reversal", "row, with guard lines"): {"motion", "row N open"},
    ("broken_reversal", "column, with guard lines"): {"column N open"},
    ("stuck_reversal", "columns shorted to the rows' level"): {"stuck"},
    ("silence", "`latest(max_age_s=0.005)`"): {"NoData"},
    ("ghost", "zones"): {"ghost"},
    ("ghosts", "zones"): {"ghost"},
    ("ghosts", "cells"): {"ghost"},
    ("stuck", "columns shorted to the rows' level"): {"stuck"},
    ("baud", "host faster, frames"): {"OnlyNoise"},
    ("baud", "host slower, frames"): {"OnlyNoise"},
    ("baud", "host faster, requests"): {"ReadTimeout"},
    ("baud", "host slower, requests"): {"ReadTimeout"},
    ("noise", "half a bit to two bits long"): {"lost", "damaged"},
    ("host", "every frame of `contactfpga.open()`"): {"lost"},
}
"""What is wrong here is reported at every value, by nothing but these; N is any line."""

NOT_NOTICED = {
    ("silence", "`latest()`"): (6, 1000),
    ("diodes", "the same with guard lines"): (1, 2),
    ("diodes_reversal", "the same with guard lines"): (1, 2),
    ("moving", "`raster`"): (1, 1),
    ("moving", "starter kit, 10 N"): (2, 3),
    ("clock", "board with `clock_hz` off"): (0.3, 1),
}
"""First and last value at which nothing is told; what is neither here nor in TOLD nor always right is never told."""


QUICK = [
    ("winding", "`run`"),
    ("diodes", "three fingers at corners"),
    ("ghosts", "zones"),
    ("broken", "row"),
]
"""What `make test-all` turns: some seconds each, with few boards beside the reference Skin's."""


@pytest.fixture(scope="module")
def turn():
    """``turn(knob, method)``: every value of its knob, the first time it is asked for."""

    @functools.cache
    def turn(name, method):
        values, run = KNOBS[name].values, KNOBS[name].runs[method]
        return Sweep(values, tuple(map(run, values)))

    return turn


@pytest.fixture(scope="module")
def turned(turn):
    """All studies with all methods, for tests of the campaign."""
    return {name: {method: turn(name, method) for method in knob.runs} for name, knob in KNOBS.items()}


@pytest.mark.slow
@pytest.mark.parametrize(("name", "method"), sample(METHODS, QUICK), ids=map(" ".join, METHODS))
def test_it_breaks_where_the_page_says(turn, name, method):
    place = list(KNOBS[name].runs).index(method)
    lines = section("failures.md", "failures").splitlines()
    first = next(
        number for number, line in enumerate(lines) if line.startswith(writer.spelled(f"| {KNOBS[name].title}: "))
    )
    found = tables.rows(KNOBS[name], {method: turn(name, method)})[0]
    assert lines[first + place].split(" | ")[1:-1] == list(found[1:-1])


@pytest.mark.slow
@pytest.mark.parametrize(("name", "method"), sample(METHODS, QUICK[2:3]), ids=map(" ".join, METHODS))
def test_two_other_seeds_break_there_or_a_step_beside(turn, name, method):
    knob, first = KNOBS[name], turn(name, method).broken
    assert knob.runs[method].seed == 0
    places = [len(knob.values) if first is None else first]
    for seed in (1, 2):
        run = dataclasses.replace(knob.runs[method], seed=seed)
        broken = next((at for at, value in enumerate(knob.values) if not run(value).right), len(knob.values))
        places.append(broken)
    assert max(places) - min(places) <= 1


@pytest.mark.slow
@pytest.mark.parametrize(("name", "method"), sample(METHODS, QUICK), ids=map(" ".join, METHODS))
def test_nothing_wrong_leaves_unnoticed_but_what_is_listed(turn, name, method):
    found, key = turn(name, method), (name, method)
    silent = [value for value, verdict in zip(found.values, found.verdicts) if verdict == "silent"]
    told = {re.sub(r"\d+", "N", word) for outcome in found.outcomes for word in outcome.told}
    if key in TOLD:
        assert not silent
        assert told == TOLD[key]
    elif key in NOT_NOTICED:
        assert (silent[0], silent[-1]) == NOT_NOTICED[key]
    elif found.broken is not None:
        assert "told" not in found.verdicts or name == "settle"
        assert found.outcomes[found.broken].verdict == "silent"


def test_what_passes_unnoticed_has_its_reason_on_the_page():
    reasons = section("failures.md", "unnoticed")
    names = {writer.spelled(f"{knob.title}: {knob.axis}"): name for name, knob in KNOBS.items()}
    silent, name = set(), ""
    for row in section("failures.md", "failures").splitlines()[2:]:
        name = names.get(row[2:].partition(" | ")[0], name)
        silent |= {name} if "**not noticed**" in row else set()
    assert {row[2:].partition(" | ")[0] for row in reasons.splitlines()[2:]} == {
        writer.spelled(KNOBS[one].title) for one in silent
    }
    for name in silent:
        assert KNOBS[name].unnoticed
        assert f"| {KNOBS[name].unnoticed} |" in reasons


@pytest.mark.campaign
def test_the_page_is_up_to_date(turned):
    assert not outdated("failures", turned)


# ---- the same by other ways


def test_the_arm_winds_without_touching_itself_or_the_finger():
    for quarters in range(12):
        cells = touch.arm(16, quarters)
        tips = (ndimage.convolve(cells.astype(int), np.ones((3, 3), int), mode="constant") * cells) == 2
        assert ndimage.label(cells, np.ones((3, 3)))[1] == 1
        assert tips.sum() == (2 if quarters else 0)  # a line with two ends
        cells[7:9, 7:9] = True
        assert ndimage.label(cells, np.ones((3, 3)))[1] == 2


@pytest.mark.slow
@pytest.mark.parametrize("name", sample(["winding", "crossing"], quick=["winding"]))
def test_zones_are_those_of_image_tools(turn, name):
    for outcome in turn(name, "`run`").outcomes:
        assert len(outcome.zones) == ndimage.label(outcome.cells, np.ones((3, 3)))[1]


@pytest.mark.campaign
@pytest.mark.parametrize(("connectivity", "pitch"), [(8, 10), (4, 10), (8, 5), (4, 5)])
def test_fingers_that_close_in_are_counted_as_often_as_geometry_and_image_tools_say(turn, connectivity, pitch, rng):
    """Rates of other pairs, which share no code with the scenes."""
    structure = np.ones((3, 3)) if connectivity == 8 else None
    found = turn("closing", f"{connectivity}-connectivity, {pitch} mm")
    draws = 2000
    for gap, outcome in zip(found.values, found.outcomes, strict=True):
        right = sum(two_discs(gap, pitch, structure, rng) == 2 for _ in range(draws))
        shown, of = shown_rate(outcome.rate)
        assert ranksum(right, draws, shown, of) > 1e-4, gap
        if gap >= pitch * (math.sqrt(2) if connectivity == 8 else 1):  # a free row or column at any place and angle
            assert (right, shown) == (draws, of)


def two_discs(gap, pitch, structure, rng):
    """How many contacts are counted of two discs of 8 mm at a random place and angle."""
    (x, y), angle = (rng.uniform(7, 8) * pitch for _ in range(2)), rng.uniform(0, math.pi)
    away = gap / 2 + 8
    ends = [(x + side * away * math.cos(angle), y + side * away * math.sin(angle)) for side in (-1, 1)]
    at = np.arange(16) * float(pitch)
    cells = np.any([np.hypot(at - cx, at[:, None] - cy) <= 8.0 for cx, cy in ends], axis=0)
    return ndimage.label(cells, structure)[1]


@pytest.mark.slow
@pytest.mark.parametrize("diameter", sample([8, 16, 24], quick=[24]))
def test_no_finger_is_felt_whose_force_closes_no_switch_and_each_that_closes_one(turn, diameter):
    """No tile takes more than all of the force, and the one in the middle at least a quarter, or the share that a flat
    disc of the finger's greatest size puts on it. A dome of 0.4 N differs by 10 % from the next."""
    found = turn("light", f"{diameter} mm")
    share = min(0.25, 6.4**2 / (math.pi * (diameter / 2) ** 2))
    for force, outcome in zip(found.values, found.outcomes, strict=True):
        right, of = shown_rate(outcome.rate)
        assert not (force < 0.7 * 0.4 and right)
        assert not (force > 1.3 * 0.4 / share and right < 0.99 * of)
    assert 0.4 < found.holds_until < 1.3 * 0.4 / share


@pytest.mark.campaign
@pytest.mark.parametrize("force", [2, 5, 10])
def test_fingers_on_the_kit_are_told_apart_as_image_tools_count_them(turn, force):
    for outcome in turn("closing", f"starter kit, {force} N each").outcomes:
        assert len(outcome.zones) == ndimage.label(outcome.cells)[1]


def shown_rate(text):
    """Right draws and all of them, from the share and the interval that are shown."""
    share = float(re.match(r"[\d.]+", text)[0])
    for of in knobs.LOOKS:
        near = round(share * of / 100)  # the share is rounded
        for right in range(max(0, near - 1), min(of, near + 1) + 1):
            if knobs.words(stats.Rate(right, of)) == text:
                return right, of
    raise AssertionError(text)


def ranksum(right, of, other, other_of):
    """How likely two shares differ so much by chance."""
    return fisher_exact([[right, of - right], [other, other_of - other]]).pvalue


def test_closed_forms_lie_where_the_page_says():
    """From pitch, sizes and rates alone; where chance plays a part, near the value that holds in 95 %."""
    closed = {(name, method): value for name, knob in KNOBS.items() for method, value in knob.closed.items()}
    pairs = {f"{c}-connectivity, {p} mm": p * (2**0.5 if c == 8 else 1) for c in (8, 4) for p in (10, 5)}
    assert closed == pytest.approx(
        {
            **{("closing", method): value for method, value in pairs.items()},
            ("crossing", "`run`"): 24 + 10 * 2**0.5,
            ("bounce", "`sym_defer_pk`"): 96,
            ("bounce", "`asym_eager_defer_pk`"): 96,
            ("baud", "host faster, frames"): 50 / 9.5,
            ("baud", "host slower, frames"): 50 / 9.5,
            ("noise", "half a bit to two bits long"): -math.log(0.95) / 96e-6,
            ("host", "every frame of `contactfpga.open()`"): 4095 / 21 * 0.096,
        },
        rel=0.003,
    )


def between(found, value):
    """Whether a break that is found lies where it was computed."""
    return found.holds_until <= value <= found.breaks_at


OTHERS_PF = 16 * 2 + 2 * 3 + 15 * 4
"""Of a column beside its own capacitance: crossings, neighbors, blocked diodes of the other rows' pressed switches."""


@pytest.mark.campaign
def test_settle_times_are_those_of_the_closed_form(turn):
    """A neighbor is read where a column is below VIH for too long, a switch missed where it is above VIL."""
    for method, pull, level in (
        ("4.7 kΩ pull-up, `release_us = 1`", 4700.0, 0.37),
        ("40 kΩ pull-up, the same", 40_000.0, 0.19),
    ):
        found = turn("settle", method)
        factor = 1e-12 * pull * math.log((3.3 - level) / (3.3 - 2.0))
        assert between(found, 6e-6 / factor - OTHERS_PF)
        warned = found.values.index(found.warns_at)
        before = found.values[warned - 1] if warned else -math.inf
        assert before <= 1e-6 / factor - OTHERS_PF <= found.warns_at


@pytest.mark.campaign
def test_a_switch_is_missed_where_the_column_stays_above_vil(turn):
    path = 2 * 2040 + 104  # two columns share a row
    rest = 0.2 + path * (3.3 - 0.5) / 40_000
    missed = 5e-6 / (1e-12 * path * math.log((3.3 - rest) / (0.8 - rest))) - OTHERS_PF
    assert between(turn("settle", "40 kΩ, lines of 2 kΩ, `release_us = 40`"), missed)


@pytest.mark.campaign
def test_a_row_is_missed_where_its_switches_do_not_lift_it_to_vih(turn):
    """A finger closes two of a row, the guard column one: drop of the diode 0.25 to 0.35 V, pull of the row 10 kOhm."""
    most = [(3.3 - drop - 2.0) / 2.0 * 10 for drop in (0.35, 0.25)]
    found = turn("project_reversal", "the same with guard lines")
    assert found.holds_until <= 2 * most[1]
    assert found.breaks_at >= 2 * most[0]
    assert found.warns_at >= most[0]
    assert found.values[found.values.index(found.warns_at) - 1] <= most[1]


@pytest.mark.campaign
@pytest.mark.parametrize("method", ["sym_defer_pk", "asym_eager_defer_pk"])
def test_a_bounce_is_seen_once_it_lasts_longer_than_the_release_time(turn, method):
    found = turn("bounce", f"`{method}`")
    assert between(found, touch.debounced(method).derived.skin.debounce_release_us)
    assert {outcome.what for outcome in found.outcomes if not outcome.right} == {"2 touches of 1"}


@pytest.mark.campaign
def test_frames_stay_whole_until_the_middle_of_the_stop_bit_has_slipped(turn):
    """9.5 bits may add up to half a bit, give or take one look of sixteen a bit, and the width of the grid."""
    look, grid = 1 / 16, 0.25
    for method in ("host faster, frames", "host slower, frames"):
        found = turn("baud", method)
        assert 100 * (0.5 - look) / 9.5 - grid <= found.breaks_at <= 100 * (0.5 + look) / 9.5 + grid
    assert turn("baud", "host slower, frames").holds_until > 2 * 1.5  # both ends as far off as a Skin allows


@pytest.mark.campaign
def test_a_host_may_pause_until_the_systems_buffer_is_full(turn):
    frame_bytes, scan_ms = 13 + 2 * 4, 0.096
    assert between(turn("host", "every frame of `contactfpga.open()`"), line.TTY_BYTES / frame_bytes * scan_ms)


@pytest.mark.campaign
def test_moving_fingers_are_off_by_what_they_move_until_their_row_is_read():
    """A zone is off by at most one scan's motion and what a disc of this size is off at rest."""
    for method in touch.MOVING.runs.values():
        for speed in touch.MOVING.values:
            for outcome in method.draws(speed, np.random.default_rng(1), 4):
                assert outcome.amount <= speed + 0.4 or math.isinf(outcome.amount)


@pytest.mark.campaign
def test_a_noisy_line_never_makes_a_frame(turn):
    found = turn("noise", "half a bit to two bits long")
    assert not any("never sent" in outcome.what for outcome in found.outcomes)
    shares = [outcome.amount for outcome in found.outcomes]
    assert max(np.diff(shares)) < 0.05  # 120 draws may decide
    assert (shares[0], shares[-1]) == (1, 0)


# ---- the parts


def test_a_uart_of_the_boards_rate_reads_what_was_sent():
    line = Line.record(Skin(), 20, seed=1)
    sent = b"".join(packet + b"\0" for packet in line.frames)
    for rate in (0.99, 1.0, 1.01):
        assert line.read(4 * rate) == sent
    assert line.noisy(0, seed=1).read(4.0) == sent
    assert line.noisy(1e5, seed=1).read(4.0) != sent


def test_a_sheet_without_diodes_is_what_it_is_said_to_be():
    for seed in range(60):
        cells = electric.finger(electric.BARE, *electric._apart(np.random.default_rng(seed), electric.BARE, 3))
        assert ndimage.label(cells, np.ones((3, 3)))[1] == 3
        assert not (cells & ~electric.bare_read(cells)).any()


@pytest.mark.parametrize(("share", "wrong"), [(0.995, True), (0.93, False), (0.5, False)])
def test_a_rate_is_judged_wrong_at_most_once_in_twenty(share, wrong):
    """Draws that are right with a known chance; ``wrong`` is the verdict that would be."""

    def draws(value, rng, count):
        return [Outcome(bool(right)) for right in rng.random(count) < share]

    verdicts = [knobs.RateTest(draws, seed)(0.0).right for seed in range(300)]
    assert verdicts.count(not wrong) <= 15 + 3 * 15**0.5


def test_of_many_draws_the_wrong_one_that_is_not_told_is_shown():
    told, silent = Outcome(False, ("row 7 open",), "told"), Outcome(False, (), "silent")
    right = Outcome(True, ("motion",), "right")

    def of(*each):
        return knobs.RateTest(lambda value, rng, count: [*each, *([right] * count)][:count])(0.0)

    assert (of().right, of().told, of().what, of().rate) == (True, ("motion",), "right", "100 % (95.0 to 100.0)")
    assert of(*[told] * 20).told == ("row N open",)
    assert (of(*[told] * 20, silent).verdict, of(*[told] * 20, silent).what) == ("silent", "silent")
    assert (of(told).right, of(told).what) == (True, "right")  # in far more than 95 % of the draws that then are made


def outcomes(*verdicts):
    made = {
        "right": Outcome(True),
        "warned": Outcome(True, ("stuck",)),
        "told": Outcome(False, ("stuck",), "2 zones of 1 contact"),
        "silent": Outcome(False, (), "2 zones of 1 contact"),
    }
    return Sweep(tuple(range(len(verdicts))), tuple(made[verdict] for verdict in verdicts))


NEVER = "fails at the first value"


@pytest.mark.parametrize(
    ("verdicts", "expected"),
    [
        (("right", "right"), ["1, end of range", "", "", "no failure", ""]),
        (("silent",), [NEVER, "**0**", "", "2 zones of 1 contact", "**not noticed**"]),
        (("right", "told"), ["0", "**1**", "", "2 zones of 1 contact", "`stuck`"]),
        (("right", "warned", "right", "told"), ["2", "**3**", "", "2 zones of 1 contact", "`stuck`, from 1 on"]),
        (("right", "told", "silent"), ["0", "**1**", "", "2 zones of 1 contact", "`stuck`; **not noticed** at 2"]),
        (("silent", "told"), [NEVER, "**0**", "", "2 zones of 1 contact", "**not noticed**; `stuck` from 1 on"]),
    ],
)
def test_lines_of_the_table(verdicts, expected):
    knob = Knob("x", "X", "x", tuple(range(len(verdicts))), {}, "it helps")
    (line,) = tables.rows(knob, {"method": outcomes(*verdicts)})
    assert line[1:-1] == ("method", *expected)
