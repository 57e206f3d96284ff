"""The figures in the pages are those the gateware gives."""

from pathlib import Path

import pytest
from sample import sample
from study_pages import outdated, section

from contactfpga.skin import Skin
from contactfpga_sim.lab import writer
from contactfpga_sim.lab.performance import scans

ROOT = Path(__file__).resolve().parents[2]


def test_the_reference_skins_row_is_up_to_date():
    assert (
        writer.spelled(scans.reference_row("reference", Skin())) in section("performance.md", "reference").splitlines()
    )


@pytest.mark.parametrize("report", sample(scans.REPORTS, quick=["moments"]))
def test_the_reference_skins_reports_are_up_to_date(report):
    row = scans.report_row("reference", Skin(report=report))
    assert writer.spelled(row) in section("performance.md", "report").splitlines()


def test_the_reference_skin_keeps_the_promised_latency():
    """Two scans, the wire and 3 us."""
    skin = Skin()
    latency = scans.touch_latencies(skin)
    wire = 17 * 10 / 3
    assert latency["last byte"].worst <= 2 * 96 + wire + 3
    assert latency["contact"].worst <= 96 + 4 / 12


def test_the_gains_of_the_adaptive_scan_are_up_to_date():
    assert not outdated("performance", "gain")


def test_the_times_of_pressure_units_are_up_to_date():
    assert not outdated("units")


@pytest.mark.campaign
@pytest.mark.timeout(3600)
def test_all_tables_are_up_to_date():
    assert not outdated("performance", without=() if scans.RECORDINGS.is_dir() else ("recorded", "labeller_recorded"))
