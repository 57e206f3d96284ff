"""Where methods fail: each break and what reports it as the page says, found again by turning."""

import functools
import math

import numpy as np
import pytest
from sample import sample
from scipy import ndimage
from study_pages import section

from contactfpga.skin import Skin
from contactfpga_sim.lab import knobs, writer
from contactfpga_sim.lab.failures import electric, tables, touch
from contactfpga_sim.lab.failures.catalogue import KNOBS
from contactfpga_sim.lab.failures.line import Line
from contactfpga_sim.lab.knobs import Knob, Outcome, Sweep

pytestmark = pytest.mark.timeout(1200)  # boards may have to be built


METHODS = [(name, method) for name, knob in KNOBS.items() for method in knob.runs]


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


# ---- the same by other ways


def test_the_arm_winds_without_touching_itself_or_the_finger():
    for quarters in range(12):
        cells = touch.arm(16, quarters)
        tips = (ndimage.convolve(cells.astype(int), np.ones((3, 3), int), mode="constant") * cells) == 2
        assert ndimage.label(cells, np.ones((3, 3)))[1] == 1
        assert tips.sum() == (2 if quarters else 0)  # a line with two ends
        cells[7:9, 7:9] = True
        assert ndimage.label(cells, np.ones((3, 3)))[1] == 2


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
