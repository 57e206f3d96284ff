"""Electrical faults: what the guard lines of the compiled gateware tell, and how fast."""

import numpy as np
import pytest

from contactfpga.skin import Skin
from contactfpga_sim.lab.failures.rig import GUARDED, REFERENCE
from contactfpga_sim.lab.safety import compute, tables, trial
from contactfpga_sim.lab.safety.catalogue import FAULTS, SheetFault
from contactfpga_sim.lab.safety.compute import Place
from contactfpga_sim.lab.safety.trial import Told
from contactfpga_sim.model.sheet import wiring

pytestmark = pytest.mark.timeout(1200)  # boards may have to be built


LIMIT_US = 2 * GUARDED.derived.frame_clocks // GUARDED.derived.clocks_per_us + 1000
"""Two frames and a millisecond: what guard lines promise."""

GUARDED_TELLS = {"broken row", "broken column", "row connector", "column connector", "selected row", "stuck column"}
NEVER = {"closed switch", "dead switch", "shorted columns", "broken contact"}


guarded = pytest.mark.slow
"""Of tests on the board with guard lines, which no other test compiles."""


def one(skin, fault, number=-1):
    """A fault at its last place: a line at the far end."""
    name, hurt = list(compute.places(skin, fault))[number]
    return compute.at(skin, hurt, name)


@guarded
@pytest.mark.parametrize("fault", sorted(GUARDED_TELLS))
def test_guard_lines_tell_a_dead_line_in_time(fault):
    place = one(GUARDED, fault)
    assert place.harmful
    assert place.us("flags") <= LIMIT_US
    assert place.us("alive") <= LIMIT_US + trial.QUIET_US
    assert place.us("contact") <= LIMIT_US


@pytest.mark.parametrize("fault", ["broken row", "broken column", "column connector"])
def test_without_guard_lines_a_dead_line_is_not_told(fault):
    place = one(REFERENCE, fault)
    assert place.harmful
    assert place.us("flags") is None
    assert place.wrong > 20


@guarded
@pytest.mark.parametrize("fault", sorted(NEVER))
def test_what_no_line_can_show_is_not_told(fault):
    place = one(GUARDED, fault, 0)
    assert place.harmful
    assert [place.us(by) for by in ("flags", "deadline", "alive")] == [None] * 3


@guarded
def test_a_whole_sheet_is_right_and_tells_nothing():
    place = compute.at(GUARDED, SheetFault())
    assert not place.harmful
    assert [place.us(by) for by in ("flags", "deadline", "alive", "contact")] == [None] * 4
    assert place.wrong == 0


@guarded
def test_a_dead_board_stops_frames_and_alive():
    place = one(GUARDED, "dead board")
    assert place.us("deadline") == pytest.approx(trial.DEADLINE_US, abs=trial.STEP_US)
    assert place.us("alive") == pytest.approx(trial.QUIET_US, abs=trial.STEP_US)
    assert one(GUARDED, "broken link").us("alive") is None


@guarded
def test_two_pins_that_fight_are_told_where_the_column_reads_released():
    pressed, released = (one(GUARDED, "shorted rows", number) for number in (0, 1))
    assert pressed.us("flags") is None
    assert released.us("flags") <= LIMIT_US


# ---- the catalogue


def test_every_line_is_cut_at_both_ends():
    for fault, lines, ends in (("broken row", 16, "column"), ("broken column", 16, "row")):
        names = set(FAULTS[fault].places(Skin()))
        kind = fault.split()[1]
        assert {f"{kind} {line} at {ends} {end}" for line in range(lines) for end in (0, 15)} <= names


def test_guard_switches_surround_the_cells_and_their_corner_is_open():
    cells = np.eye(2, 3, dtype=bool)
    sheet = wiring.extended(cells)
    assert sheet.tolist() == [
        [True, False, False, True],
        [False, True, False, True],
        [True, True, True, False],
    ]
    sheet[1, 3] = sheet[2, 0] = False
    assert wiring.missed(sheet) == ({1: 3}, {0: 2})


# ---- what is made of it


def told(by, wrong=0, harmful=True, words=()):
    return Told(by, words, wrong, harmful)


def test_a_fault_that_rest_does_not_tell_has_to_be_told_wherever_it_does_harm():
    place = Place(
        "here", {"rest": told({}, harmful=False), "finger": told({"flags": 80}), "all": told({"flags": 96}, 1)}
    )
    assert (place.us("flags"), place.wrong) == (96, 1)
    half = Place("here", place.scenes | {"all": told({}, 50)})
    assert (half.us("flags"), half.wrong) == (None, 50)
    assert Place("here", half.scenes | {"rest": told({"flags": 144}, harmful=False)}).us("flags") == 144


def test_coverage_counts_faults_that_are_told_at_every_place(monkeypatch):
    tells, says_nothing = (
        Place("here", dict.fromkeys(("rest", "finger", "all"), told(by))) for by in ({"flags": 100, "deadline": 90}, {})
    )
    halves = {"broken row": (tells, tells), "broken column": (tells, says_nothing)}
    monkeypatch.setattr(compute, "found", lambda skin, fault: halves.get(fault, (says_nothing,)))
    monkeypatch.setattr(compute, "times_at_start", lambda fault: {})
    lines = tables.coverage_table().splitlines()[2:]
    listed, places = len(FAULTS), len(FAULTS) + 2
    assert lines[0] == f"| none | 1 of {listed} | {100 / listed:.0f} % | 3 of {places} |"
