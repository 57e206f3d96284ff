"""The pages on the cover: errors in their tables."""

import math

import pytest
from study_pages import section

from contactfpga.design.cover import Ball, Cap, Cover
from contactfpga.design.cover.felt import LENGTH_M, WIDTH_M
from contactfpga.design.cover.sense import LADDER
from contactfpga_sim.lab.cover import caps, formulas, tables
from contactfpga_sim.lab.registry import StudyRun
from contactfpga_sim.lab.studies import STUDIES

RUN = StudyRun(STUDIES["cover"])


def test_errors_of_the_models_are_up_to_date():
    assert section("cover.md", "sense") == RUN.text("sense")


def test_a_strip_sags_as_a_clamped_beam_does():
    """Ten times as thick, it shears alone; ten times as long, it bends."""
    thick = Cover("foam", 0.1, cap=Cap(5e-3), modulus_pa=1e5)
    thin = Cover("foam", 1e-4, cap=Cap(5e-3), modulus_pa=1e5)
    pressed = math.pi / 4 * LENGTH_M * WIDTH_M
    by_shear = 1e-4 / (6 / 5 * 5e-3**2 / (8 * 1e5 / 2.4 * 0.1))
    by_bending = 1e-4 / (5e-3**4 / (32 * 1e5 / 0.96 * 1e-4**3))
    assert caps.sagging_n(thick, 10e-3, 1e-4) == pytest.approx(by_shear * pressed, rel=0.01)
    assert caps.sagging_n(thin, 10e-3, 1e-4) == pytest.approx(by_bending * pressed, rel=0.01)


def test_the_reference_has_no_error_and_the_half_space_has():
    ball = Ball(1e-4, 1e7)
    assert formulas.sense_errors(LADDER[-1], ball) == [0] * len(formulas.PLACES)
    half = formulas.sense_errors(LADDER[0], ball)
    assert half[0] == pytest.approx(0.57, abs=0.01)
    assert abs(half[2]) < 0.01
    assert half[-1] < -0.7


@pytest.mark.slow
def test_the_pictures(tmp_path):
    drawn = sorted(file.name for file in tables.draw(tmp_path))
    assert drawn == ["cover-caps.svg", "cover-force.svg", "cover-map.svg"]
    assert drawn == sorted(file.name for file in tmp_path.glob("*.svg"))
