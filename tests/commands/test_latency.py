"""`contactfpga latency`: what it prints, what it refuses, and the figures of the examples."""

import functools
import json

import numpy as np
import pytest
from reversal import FAST, small

from contactfpga import examples
from contactfpga.skin import Skin
from contactfpga.tools import cli
from contactfpga_sim.lab import latency

FILE = str(examples() / "fast.toml")


@pytest.fixture
def run(run):
    """Runs `contactfpga latency`; returns status, output and errors."""
    return functools.partial(run, "latency")


@pytest.mark.campaign  # it has a board to compile
def test_the_fast_example_reaches_its_figures(run):
    """Figures of the issue for 16x16: a fingertip on an untouched sheet, a change while frames are on the wire, and
    frames while it moves; the wire would take 70,588 per second."""
    status, out, _ = run("--skin", FILE, "--touches", "12", "--json")
    assert status == 0
    found = json.loads(out)
    assert {"touch_to_last_byte_us", "touch_to_contact_us", "frames_per_s", "bytes"} <= set(found)
    spreads = [value for value in found.values() if isinstance(value, dict)]
    assert all(set(spread) == {"median", "worst"} for spread in spreads)
    assert all(0 < spread["median"] <= spread["worst"] for spread in spreads)
    last, pin = found["touch_to_last_byte_us"], found["touch_to_contact_us"]
    assert last["median"] <= 20
    assert last["worst"] <= 21
    assert pin["worst"] <= 0.25
    assert 70_000 <= found["frames_per_s"] <= 12_000_000 / 10 / found["bytes"] + 1
    assert found["bytes"] == 17
    assert found["change_to_last_byte_us"]["worst"] <= 38
    # The slots and the bits cannot take less; what is over them is at most a tenth.
    bound = 1.0 + 3 * 0.75 + found["bytes"] * 10 / 12
    assert bound < last["median"] <= 1.1 * bound + 0.1


@pytest.mark.slow
def test_the_figures_are_told_in_words(run):
    status, out, _ = run("--skin", FILE, "--cells", "2x5", "--touches", "2")
    assert status == 0
    assert "16x16, scan 'reversal', 24 MHz, 12 Mbaud" in out
    assert "2x5 cells at 2 places" in out
    for title in ("touch to last byte", "touch to contact pin", "frames per second", "bytes"):
        assert title in out


@pytest.mark.slow
@pytest.mark.parametrize("cells", ["1x1", "16x16"])
def test_the_smallest_and_the_largest_contact(run, cells):
    status, out, _ = run("--skin", FILE, "--cells", cells, "--touches", "1", "--json")
    assert status == 0
    assert json.loads(out)["touches"] == 1


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("--cells", "20x20"), "20x20 cells; the sheet has 16x16"),
        (("--cells", "3x17"), "3x17 cells; the sheet has 16x16"),
        (("--skin", "no-such.toml"), "no-such.toml"),
    ],
)
def test_errors_are_one_line(run, words, message):
    status, out, err = run(*words)
    assert (status, out) == (1, "")
    assert message in err
    assert err.count("\n") == 1
    assert "Traceback" not in err


@pytest.mark.parametrize("cells", ["0x3", "3x0", "3", "axb", "100x1", "3x3x3", "", "٣x٣"])
def test_what_is_no_size_is_refused(capsys, cells):
    with pytest.raises(SystemExit) as caught:
        cli.main(["latency", "--cells", cells])
    assert caught.value.code == 2
    assert "write rows x columns of the contact, such as 3x3" in " ".join(capsys.readouterr().err.split())


def test_a_contact_has_no_masked_switches():
    """They are never reported, so nobody can wait for them."""
    skin = small(rows=3, columns=3, mask=((0, 0), (0, 1), (1, 1)))
    found = latency.places(skin, 1, 2)
    assert all(cells.any() and not cells[0, 0] and not cells[1, 1] for cells in found)
    assert len(found) == 5, "one of six places has masked switches only"
    assert sum(cells.sum() for cells in latency.places(skin, 1, 1)) == 6


def test_places_are_all_places():
    found = latency.places(FAST, 3, 5)
    assert len(found) == 14 * 12 == len({cells.tobytes() for cells in found})
    assert all(cells.sum() == 15 and np.ptp(np.nonzero(cells)[0]) == 2 for cells in found)


@pytest.mark.campaign  # it has a board to compile
def test_touches_that_always_meet_a_keep_alive_end_with_a_sentence():
    skin = Skin(rows=4, columns=4, send="on_change", keep_alive_ms=0.06)
    with pytest.raises(latency.Late, match=r"keep_alive_ms is 0\.06, measure with a longer one"):
        latency.measure(skin, (1, 1), 2)
