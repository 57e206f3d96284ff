"""Whether a light finger is felt: the function and the command `contactfpga cover felt`."""

import dataclasses
import itertools
import json
import math

import numpy as np
import pytest

import contactfpga
from contactfpga.design.cover import (
    BODIES,
    Cap,
    Cells,
    Cover,
    CoverError,
    Ellipse,
    Load,
    NoSolution,
    Sheet,
    Switch,
    feel,
)
from contactfpga.design.cover.felt import spread_evenly

TILES = contactfpga.examples() / "tiles.toml"
SHEET = Sheet(7, 9, 10e-3, 8e-3)


def tiles(force=1.0, **switch):
    return Cover("foam", 2e-3, Switch(force, **switch), cap=Cap(7e-3), cut=True)


def whole(travel_m=0.0):
    return Cover("foam", 3e-3, Switch(0.5, travel_m=travel_m), cap=Cap(7e-3))


COVERS = {
    "tiles": tiles(),
    "flush": Cover("foam", 4e-3),
    "caps": whole(),
    "caps that give way": whole(2e-4),
    "point": Cover("point", 4e-3),
}


def pressed(cover, sheet, force, place, seed=0):
    """Whether a touch at this place, x and y in m and angle in rad, closes a switch of the whole sheet."""
    x, y, angle = place
    cells = Cells(cover, sheet.rows, sheet.columns, sheet.pitch_x_m, sheet.pitch_y_m, seed)
    return cells.closed([Load(finger(cells, force, x, y, angle), force)]).any()


def finger(cells, force, x, y, angle):
    pressed = cells.indentation([Ellipse(6e-3, 5e-3)], BODIES["finger"])
    return tuple(part.placed(x, y, angle) for part in pressed.parts_at(pressed.depth_m(force)))


# ---- against the switches that close


@pytest.mark.parametrize("cover", COVERS.values(), ids=COVERS)
def test_that_share_of_touches_closes_a_switch_of_the_whole_sheet(cover):
    """Just above the force at which they are felt, and no longer just below."""
    found, places = feel(cover, SHEET, places=100), spread_evenly(100, SHEET)
    for force, count in ((found.half, 50), (found.most, 99), (found.worst, 100)):
        above, below = (
            sum(pressed(cover, SHEET, factor * force.value_n, place) for place in places) for factor in (1.001, 0.999)
        )
        assert below < count <= above
    x, y = found.worst_m
    (at,) = np.flatnonzero((places[:, 0] == x) & (places[:, 1] == y))
    assert not pressed(cover, SHEET, 0.999 * found.worst.value_n, places[at])


def test_a_window_of_a_large_sheet_takes_what_the_whole_sheet_does():
    cover, sheet = whole(2e-4), Sheet(30, 30, 8e-3, 8e-3)
    found, places = feel(cover, sheet, places=30), spread_evenly(30, sheet)
    for factor, count in ((1.001, 30), (0.999, 29)):
        assert sum(pressed(cover, sheet, factor * found.worst.value_n, place) for place in places) == count


def test_places_fill_the_sheet_evenly():
    """Each sixteenth of the sheet gets its share of them, and each quarter of the angles."""
    x, y, angle = spread_evenly(1600, SHEET).T
    across, down = (x / SHEET.pitch_x_m + 0.5) / SHEET.columns, (y / SHEET.pitch_y_m + 0.5) / SHEET.rows
    counts, *_ = np.histogram2d(across, down, bins=4, range=[[0, 1], [0, 1]])
    assert counts.min() >= 90
    assert counts.sum() == 1600
    assert np.histogram(angle, bins=4, range=(0, np.pi))[0].min() >= 380


# ---- closing forces that differ, absent switches, closed sheets


def test_forces_of_drawn_sheets_lie_in_the_interval():
    """95 % of sheets that it has not seen, give or take four of 100."""
    cover = tiles(0.5, spread=0.2)
    found = feel(cover, SHEET, places=150)
    assert found.sheets == 40
    assert found.most.low_n < found.most.value_n < found.most.high_n
    others = [feel(cover, SHEET, places=150, seed=1000 + 40 * n).most.value_n for n in range(2)]
    assert all(found.most.low_n < other < found.most.high_n for other in others)
    assert feel(tiles(0.5), SHEET, places=50).sheets == 1


def test_fingers_on_absent_switches_are_not_felt():
    mask = tuple(itertools.product(range(SHEET.rows), range(6)))
    assert isinstance(feel(tiles(), Sheet(7, 9, 10e-3, 8e-3, mask), places=60).most, NoSolution)
    one = feel(tiles(), Sheet(7, 9, 10e-3, 8e-3, ((3, 4),)), places=200)
    assert one.worst.value_n > feel(tiles(), SHEET, places=200).worst.value_n


def test_on_a_closed_sheet_a_finger_over_the_seam_presses_both_sides():
    """One switch of four: on the open sheet it feels 43 % of touches, on the closed one 62 %."""
    only = tuple((0, column) for column in range(1, 4))
    sheets = [Sheet(1, 4, 10e-3, 10e-3, only, on) for on in (False, True)]
    opened, closed = (feel(tiles(), sheet, 16e-3, 14e-3, places=300).half for sheet in sheets)
    assert isinstance(opened, NoSolution)
    assert not isinstance(closed, NoSolution)


def test_between_small_faces_far_apart_no_force_is_felt():
    """Thin foam, small faces, wide pitch."""
    found = feel(Cover("foam", 1e-3), Sheet(6, 6, 30e-3, 30e-3), places=100)
    assert str(found.most) == "no solution: more than 1 % of touches close no switch, whatever their force"


KIT = Cover(
    *("foam", 2e-3, Switch(0.4, travel_m=2e-4, spread=0.1, hysteresis=0.2, preload_n=0.05)),
    cap=Cap(5.8e-3, mass_kg=1e-3),
    cut=True,
)
STIFF = dataclasses.replace(KIT, switch=Switch(0.4))
BASES = {
    "cut": STIFF,
    "proud": dataclasses.replace(STIFF, cut=False),
    "area_m2": Cover("foam", 2e-3, Switch(0.4, area_m2=30e-6)),
}
"""Covers whose answers a key changes that the kit's does not have."""
KEYS = {key.name for kind in (Cover, Cap, Switch) for key in dataclasses.fields(kind)}


@pytest.mark.parametrize("key", sorted(KEYS - {"model", "share", "switch", "cap", "bed", "cell"}))
def test_each_key_changes_an_answer(key):
    """Half the value, or the other one of two, moves an answer by 2 % or more."""
    cover = BASES.get(key, KIT)
    usual, other = (answers(one) for one in (cover, changed(cover, key)))
    assert max(abs(other / usual - 1)) > 0.02


def changed(part, key):
    """A cover, cap or switch with half a value, or with the other one of two."""
    if key in part.__dataclass_fields__:
        value = getattr(part, key)
        return dataclasses.replace(part, **{key: not value if isinstance(value, bool) else value / 2})
    inner = "cap" if key in Cap.__dataclass_fields__ else "switch"
    return dataclasses.replace(part, **{inner: changed(getattr(part, inner), key)})


def answers(cover):
    """The force from which a finger is felt, its interval, the depth there, the force at which the switch opens, the
    force that stops a rigid arm within 1.2 mm, and the logarithm of false presses."""
    pitch = 6.4e-3
    half, cells = feel(cover, Sheet(6, 6, pitch, pitch), places=60).half, Cells(cover, 6, 6, pitch, pitch)
    pressed, rigid = cells.indentation([Ellipse(6e-3, 5e-3)], BODIES["finger"]), BODIES["rigid"]
    stopped = cells.indentation([rigid.ball(0.038)], rigid).force_n(1.2e-3)
    share, every = cells.forces_n([Load(finger(cells, 1.0, 2 * pitch, 2 * pitch, 0.0), 1.0)]), np.ones((6, 6), bool)
    opens = min(force for force in np.geomspace(0.1, 10, 500) if cells.closed_by(force * share, every).any())
    false = math.log(1e-300 + cells.false_presses(30.0, 300.0))
    return np.array([half.value_n, 1 + half.high_n - half.low_n, pressed.depth_m(half.value_n), opens, stopped, false])


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: feel(Cover(), SHEET), "model is 'patch', which knows no force"),
        (lambda: feel(tiles(), SHEET, length_m=0.0), "length_m is 0.0; it must be a finite number above 0 m"),
        (lambda: feel(tiles(), SHEET, places=0), "places is 0; it must lie between 1 and 100000"),
        (lambda: feel(tiles(), Sheet(4, 4, 5e-3, 5e-3)), "a cap is 0.007 m wide; the pitch is 0.005 m"),
    ],
)
def test_what_cannot_be_felt_is_refused(make, words):
    with pytest.raises(CoverError, match=words):
        make()


# ---- the command, on the example


def test_the_tiles_feel_two_newtons_anywhere(run):
    status, out, errors = run("felt", TILES, "--places", 500, "--json")
    found = json.loads(out)
    assert (status, errors) == (0, "")
    assert found["finger"] == {"body": "finger", "length_m": 0.012, "width_m": 0.01}
    assert found["worst"]["high_n"] < 2.0
    assert found["half"]["value_n"] < found["most"]["value_n"] < found["worst"]["value_n"]
    assert (found["places"], found["sheets"]) == (500, 40)
    assert found["false_presses"] < 1e-6


def test_the_answer_says_finger_switch_and_forces(run):
    status, out, _ = run("felt", TILES, "--places", 100, "--length", 0.016, "--acceleration", 20, "--foam-density", 300)
    assert status == 0
    for text in (
        "finger, 16 x 10 mm at a depth of 3 mm, at 100 places",
        "0.4 N, 10 % spread",
        "99 % of touches felt from",
    ):
        assert text in out


@pytest.mark.parametrize(
    ("table", "words"), [("", "has no table [cover]"), ("[cover]\nmodel = 'patch'\n", "has the model 'patch'")]
)
def test_a_skin_without_forces_gets_one_clear_line(run, tmp_path, table, words):
    file = tmp_path / "skin.toml"
    file.write_text(f"rows = 8\n{table}", encoding="utf-8")
    status, out, errors = run("felt", file)
    assert (status, out) == (1, "")
    assert words in errors
    assert "examples/tiles.toml" in errors
    assert len(errors.strip().splitlines()) == 1


def test_no_solution_has_a_status_of_its_own(run, tmp_path):
    file = tmp_path / "skin.toml"
    file.write_text(
        "pitch_x_mm = 30\npitch_y_mm = 30\n[cover]\nmodel = 'foam'\nthickness_m = 0.001\n", encoding="utf-8"
    )
    assert run("felt", file, "--places", 50)[0] == 3
    status, out, _ = run("felt", file, "--places", 50, "--json")
    assert (status, json.loads(out)["most"]["no_solution"][:11]) == (3, "more than 1")
