"""The latency that pages promise of the reference Skin."""

from pathlib import Path

from contactfpga.skin import Skin
from contactfpga_sim.lab.performance import scans

ROOT = Path(__file__).resolve().parents[2]


def test_the_reference_skin_keeps_the_promised_latency():
    """Two scans, the wire and 3 us."""
    skin = Skin()
    latency = scans.touch_latencies(skin)
    wire = 17 * 10 / 3
    assert latency["last byte"].worst <= 2 * 96 + wire + 3
    assert latency["contact"].worst <= 96 + 4 / 12
