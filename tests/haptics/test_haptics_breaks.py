"""Where force joined to location fails: the breaks that the page states, found again; and end to end."""

import re
from pathlib import Path

import numpy as np
import pytest

from contactfpga_sim.pages import failures_page, haptics_felt
from contactfpga_sim.studies.failures.knob import Turned
from contactfpga_sim.studies.haptics import breaks, felt
from contactfpga_sim.studies.haptics.breaks import STUDIES

PAGE = (Path(__file__).resolve().parents[2] / "docs" / "haptics.md").read_text(encoding="utf-8")
SLOW = ("shape", "skew", "edge")
ALL = [(name, method) for name, study in STUDIES.items() for method in study.runs]
QUICK = [
    ("unseen", "force at the zone"),
    ("torsion", "center of pressure"),
    ("clipping", "center of pressure"),
    ("friction", "interval"),
]


def on_page(name):
    """The lines of a study in the page's table."""
    table = re.search(r"<!-- figures: breaks -->\n(.*?)\n<!-- end -->", PAGE, re.DOTALL)[1].splitlines()[2:]
    starts = [at for at, line in enumerate(table) if line.startswith("| [")] + [len(table)]
    first = next(at for at in starts if f"(#{name})" in table[at])
    return table[first : starts[starts.index(first) + 1]]


@pytest.mark.parametrize(
    ("name", "method"), [pytest.param(*one, marks=[] if one in QUICK else pytest.mark.campaign) for one in ALL]
)
def test_each_break_is_where_the_page_says(name, method):
    study = STUDIES[name]
    found = Turned(study.values, tuple(map(study.runs[method], study.values)))
    line = failures_page.rows(study, {method: found})[0].split(" | ")[2:6]
    (stated,) = [one.split(" | ")[2:6] for one in on_page(name) if one.split(" | ")[1] == method]
    assert line == stated


def test_what_nothing_disturbs_is_as_stated():
    """A covariance that is too small or too large by a tenth would show."""
    trials = breaks._force(breaks.Load())
    assert 0.91 < np.mean([trial.holds for trial in trials]) < 0.99


@pytest.mark.campaign
@pytest.mark.parametrize(("setting", "most_mm"), list(zip(felt.SETTINGS, (None, 0.15, 0.4))))
def test_1000_placements_end_to_end(setting, most_mm):
    """Closings at 5 mm, with as many switches as close: 0.15 mm without noise, 0.4 mm with it."""
    errors = haptics_felt.found(setting, 1000)
    if most_mm is None:
        spread = setting.cells.noise
        assert spread is not None
        assert haptics_felt.interval(errors["center of pressure"][:, -1])[0] < 0.4e-3
    else:
        assert haptics_felt.interval(errors["closings"][:, -1])[0] <= 1e-3 * most_mm


def test_two_contacts_60_mm_apart_are_felt_apart():
    pairs = [felt.two(60.0, seed) for seed in range(2)]
    assert [one.zones for one in pairs] == [2] * 2
    off = [one for pair in pairs for one in pair.off_n]
    assert np.sqrt(np.mean(np.square(off))) < 1.2  # 0.6 N over many
