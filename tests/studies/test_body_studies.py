"""The tables of docs/body.md: links whose boards fail, sheets that are found."""

from __future__ import annotations

import pytest

from contactfpga.skin import Skin
from contactfpga_sim.lab.body import outages, tables


@pytest.mark.parametrize("outage", [outages.OUTAGES[0], outages.OUTAGES[3]], ids=lambda outage: outage.name)
def test_outage_is_told_and_ends(outage, tmp_path):
    seen = outages.play(outage, tmp_path)
    assert outage.status in seen.statuses
    assert seen.statuses[-1] == "ok"
    assert seen.noticed_s < 0.6
    assert seen.back_s < 0.7


def test_more_points_find_a_sheet_better(tmp_path):
    few, many = (tables.placement_errors(Skin(), points, tmp_path, normals=True, count=30) for points in (4, 12))
    assert many.refused == many.wrong == 0
    assert many.turned_deg < few.turned_deg
    assert many.middle_mm < 1.5
