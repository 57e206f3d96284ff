"""The arm's second line of defense: a force threshold of pressure units, compared by the board itself."""

import pytest

from contactfpga.skin import Skin
from contactfpga.tools import cli
from contactfpga_sim.lab.arm.case import Case, CaseError
from contactfpga_sim.lab.arm.run import WITH_UNITS, run
from contactfpga_sim.lab.arm.world import THRESHOLD_N, UnitsUnderSheet

PAPER = Case.load("paper").but(run={"duration_s": 0.03})
HALFWAY = PAPER.but(touch=({"x_mm": 85.0, "y_mm": 85.0},))


def test_units_share_a_push_by_its_place():
    read = UnitsUnderSheet(HALFWAY, WITH_UNITS).readings([30.0])
    assert sum(read) - 3000 == pytest.approx(30.0 / 0.02, abs=40)
    top, left, right = (one - 1000 for one in read)
    assert (75 * top - 37.5 * (left + right)) * 0.02 / 30 == pytest.approx(85 - 75, abs=1.5)  # mm from the middle


@pytest.mark.slow
def test_a_force_threshold_reacts_where_no_switch_closes():
    result = run(HALFWAY, "force")
    outcome = result.outcome
    before = result.course["time_s"] < outcome.reacts_s - PAPER.control.period_s - 20e-6
    assert outcome.closes_s is None
    assert outcome.reason == "contact"
    # 2 N, or up to 4 standard deviations of the sum less: not before, and not a sweep and a controller's period later
    assert THRESHOLD_N - 0.5 < result.course["force_n"][before].max() < THRESHOLD_N + 1.0
    assert outcome.peak_force_n < 10
    assert run(HALFWAY, "torque").outcome.peak_force_n > 20


def test_a_board_without_the_plain_sum_is_refused(capsys):
    with pytest.raises(CaseError, match=r"units is 0; the way 'force' needs units = 3"):
        run(PAPER, "force", skin=Skin())
    assert cli.main(["study", "arm", "--force-threshold", "--skin", "examples/fast.toml"]) != 0
    assert "--force-threshold runs its own Skin" in capsys.readouterr().err
