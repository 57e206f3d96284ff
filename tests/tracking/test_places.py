"""Places by the order of closings: kills weights that go to the wrong cells, a table that is read wrong, one that is no
better than the barycenter under bodies that the contact model did not make, and the covariance of another state."""

import dataclasses

import numpy as np
import pytest
from tracker_frames import moments, pressed

from contactfpga import Places, Skin, Tracker, Zones
from contactfpga.design import kits
from contactfpga.design.cover import load_cover, medium
from contactfpga.tracking.places import PlacesError, Row, Spread
from contactfpga_sim.apps import places
from contactfpga_sim.lab.cover.elements import Block, touching
from contactfpga_sim.lab.order import scores

SKIN = Skin(pitch_x_mm=6.0, pitch_y_mm=8.0, connectivity=4)
RISING = ((4.0, 1.0), (5.0, 0.0), (2.0, -2.0))
SPREADS = tuple(Spread(mm2 / share, power) for share in (1, 2) for mm2, power in RISING)
TABLE = Places(6.0, 8.0, 50.0, (Row(1, 0.0, 0.0, 0.0), Row(3, -1.5, 0.5, 20.0)), SPREADS)
TEXT = TABLE.toml()


def spot(rng, count):
    """Cells that grow one at a time from a place, each beside one before."""
    cells = [(8, 8)]
    while len(cells) < count:
        row, column = rng.choice(cells)
        step = rng.choice([(0, 1), (1, 0), (0, -1), (-1, 0)])
        new = row + step[0], column + step[1]
        cells += [new] if new not in cells else []
    return cells


def test_the_place_is_the_weighted_mean_of_the_cells(rng):
    """Also of cells that close together, and of zones that begin apart and meet, if the tracker does not mistake one of
    them for another."""
    met = mistaken = 0
    for number in range(60):
        cells = spot(rng, 7)
        apart = number % 2
        if apart:
            rng.shuffle(cells)
        steps = [rng.choice([0, 600][apart:]) + apart * rng.randint(0, 2000) for _ in cells[2:]]
        times, shown, tracker = np.cumsum([1000, 3000, *steps]), np.zeros((16, 16), bool), Tracker(places=TABLE)
        for time_us in np.unique(times).tolist():
            count = int((times <= time_us).sum())
            shown[tuple(np.array(cells[:count]).T)] = True
            track, *others = tracker.update(pressed(time_us, shown, skin=SKIN)).active
            if others or track.moved:
                continue
            met += bool(track.merged)
            y, x = np.array(cells[:count]).T * [[8.0], [6.0]]
            share = (times[:count] - 1000) / max(1, time_us - 1000)
            weight = -1.5 * share + 0.5 * share**2 if count > 2 else np.zeros(count)
            weight = (1 + weight - weight.mean()) / count
            assert track.place_mm == pytest.approx((weight @ x, weight @ y), abs=1e-9), number
            if not track.merged:
                assert track.place_cov_mm2[0] == ((4.0, 8.0)[count - 1] if count < 3 else 2 / count**2, 0.0)
        mistaken += track.moved
    assert met > 30
    assert mistaken < 4
    assert set(track.to_dict()) - set(Tracker().update(pressed(0, shown, skin=SKIN)).active[0].to_dict()) == {
        "place_mm",
        "place_cov_mm2",
        "moved",
        "missed",
    }


def test_a_contact_whose_cells_open_has_its_barycenter_until_they_close():
    tracker, square = Tracker(places=TABLE), [(8, 8), (8, 9), (9, 8), (9, 9)]
    shown = np.zeros((16, 16), bool)
    for number, (cell, told) in enumerate(
        [(square[0], False), (square[1], False), (square[2], True), (square[3], True), (square[3], True)]
        + [(None, False), (square[3], True)]
    ):
        if cell is not None:
            shown[cell] ^= True
        (track,) = tracker.update(pressed(number * 6000, shown, skin=SKIN)).active
        assert (track.place_mm != track.zone.centroid_mm, track.moved) == (told, False), number


def variance(frames):
    """The variance that is said last of frames, each a time and cells."""
    tracker = Tracker(places=TABLE)
    for time_us, cells in frames:
        shown = np.zeros((16, 16), bool)
        shown[tuple(np.transpose(cells))] = True
        (track, *_) = tracker.update(pressed(time_us, shown, skin=SKIN)).active
    assert track.place_cov_mm2[0][1] == 0.0
    return track.place_cov_mm2[0][0]


@pytest.mark.parametrize(("steps", "rising"), [([1], 4.0), ([1, 2], 8.0), ([1, 2, 4], 2 / 16), ([4], 5.0)])
def test_a_contact_at_rest_has_the_spread_of_settled_ones(steps, rising):
    """From twice the time that its cells took to close, and at least twice the time for which they may bounce."""
    square = [(8, 8), (8, 9), (9, 8), (9, 9)]
    frames = [(number * 8000, square[:count]) for number, count in enumerate(steps)]
    end, whole = frames[-1][0], square[: steps[-1]]
    late = end + 2 * max(end, 5000)
    for more, expected in (([], rising), ([(late, whole)], rising), ([(late + 1, whole)], rising / 2)):
        assert variance(frames + more) == pytest.approx(expected)


def test_frames_that_a_contact_misses_are_counted_over_the_wrap():
    """From its first frame on: gaps of 1 and 3, each beside one that is the next."""
    tracker, shown, said = Tracker(places=TABLE), np.zeros((16, 16), bool), []
    for time_us, sequence in enumerate((7, 249, 250, 252, 253, 1, 1)):
        shown[8, 8] = time_us > 0
        frame = pressed(time_us, shown, skin=SKIN).frame
        said += tracker.update(Zones(dataclasses.replace(frame, sequence=sequence), SKIN.sheet)).active
    assert [track.missed for track in said] == [0, 0, 1, 1, 4, 4]


def test_a_zone_of_parts_that_met_may_be_any_of_them():
    """The variance of the parts' middles, by the law of total variance, on average over both axes."""
    for count in (2, 3):
        parts = [[(8, column) for column in range(4)], [(9 + row, 9) for row in range(count)]]
        bridge = [(8, column) for column in range(4, 10)]
        frames = [(0, [*parts[0], *parts[1]]), (300, [*parts[0], *parts[1], *bridge])]
        met, alone = variance(frames), variance([(0, parts[0]), (300, [*parts[0], *parts[1], *bridge])])
        within = sum(len(part) * np.var(np.multiply(part, (8.0, 6.0)), axis=0).sum() for part in parts) / (4 + count)
        apart = np.var(np.multiply([*parts[0], *parts[1]], (8.0, 6.0)), axis=0).sum() - within
        assert met - alone == pytest.approx(apart / 2 if count == 3 else 0.0)


def test_cells_that_close_at_once_far_apart_or_after_a_part_left_give_the_barycenter():
    """Faster than 50 us a cell; and zones that parted have cells of unknown times."""
    fast = Tracker(places=TABLE)
    for time_us, cells in ((0, [(1, 8, 8)]), (80, [(4, 34, 34)])):
        (track,) = fast.update(moments(time_us, cells, skin=SKIN)).active
    assert track.place_mm == track.zone.centroid_mm
    assert not track.moved
    near = (TABLE.rows[0], dataclasses.replace(TABLE.rows[1], reach_mm=0.1))
    frames = [[(3, 24, 24)], [(9, 72, 74)], [(4, 24, 32), (4, 40, 32)]]
    for table, count in ((dataclasses.replace(TABLE, rows=near), 2), (TABLE, 3)):
        tracker = Tracker(places=table)
        for number, cells in enumerate(frames[:count]):
            said = tracker.update(moments(number * 4000, cells, skin=SKIN)).active
        assert [one.moved for one in said] == [True] * (count - 1)
        assert [one.place_mm for one in said] == [one.zone.centroid_mm for one in said]


@pytest.mark.parametrize(
    ("skin", "said"),
    [
        (SKIN.replace(report="barycenter"), "report is 'barycenter', which loses the sums"),
        (SKIN.replace(pitch_x_mm=6.4), "the table of places is for 6 x 8 mm; the sheet has 6.4 x 8 mm"),
    ],
)
def test_a_sheet_that_the_table_cannot_place_is_refused(skin, said):
    with pytest.raises(PlacesError, match=said):
        Tracker(places=TABLE).update(moments(0, [(1, 8, 8)], skin=skin))


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("linear = -1.5", "linear = nan", "linear is nan; it must be a number from -1,000,000,000 to 1,000,000,000"),
        ("one_mm2 = 2.5", "one_mm2 = -1", "one_mm2 is -1; it must be a number from 0 to 1,000,000,000"),
        ("power = -2", "power = -20", "power is -20; it must be a number from -9 to 9"),
        ("[[spreads]]\none_mm2 = 2.5\npower = 0\n", "", "there are 5 spreads; there must be 6"),
        ("cells = 3", "cells = 1", "rising from 1"),
        ("linear = -1.5\n", "", "lacks a value"),
        ("least_us = 50", 'least_us = "x"', "least_us is 'x'"),
        ("square = 0.5", "cube = 0.5", "unknown key 'cube' in"),
        ("[[rows]]", "[rows]", "not a TOML file"),
        (TEXT, "rows = 5", "lacks a value"),
        (TEXT, TEXT + TEXT[TEXT.index("[[rows]]") : TEXT.index("[[spreads]]")] * 60, "there must be 1 to 100"),
    ],
)
def test_a_wrong_table_is_refused_in_one_line(tmp_path, old, new, said):
    path = tmp_path / "places.toml"
    path.write_text(TEXT)
    assert Places.load(path) == TABLE
    assert old in TEXT
    path.write_text(TEXT.replace(old, new))
    with pytest.raises(PlacesError, match=said) as refused:
        Places.load(path)
    assert "\n" not in str(refused.value)


# ---- a table that the contact model fitted, judged by bodies that it did not make


@pytest.fixture(scope="module")
def fitted():
    return places.fit(scores.SKIN, scores.cover(), count=150)


def element_touch(rng, tilts):
    """Closing times of the kit's tiles under a soft body, by finite elements: each tile of foam on a cap whose switch
    gives way and, if it ``tilts``, as much at the cap's edge. Flesh is columns of 55 kPa on top."""
    cover, pitch, side, nodes = scores.cover(), 6.4, 5.8, 5
    planes = np.linspace(-side / 2, side / 2, nodes)
    tile = Block(planes, planes, np.linspace(0, 2, 4), medium.POISSON)
    travel = cover.switch.travel_m * 1e3 / cover.switch.force_n
    x, y = tile.top_x, tile.top_y
    give = tile.moved(cover.modulus_pa / 1e6)[tile.top, 2] + travel
    give += tilts * travel * (np.outer(x, x) + np.outer(y, y)) / (side / 2) ** 2
    give += np.diag(np.full(len(x), 6 / 0.055 / (side**2 / len(x))))
    place, angle = rng.uniform(7 * pitch, 8 * pitch, 2), rng.uniform(0, np.pi)
    half = rng.uniform(6, 10) * np.array([1, rng.uniform(0.6, 1)])
    depths, forces = np.linspace(0, 5, 16), np.zeros((16, 16, 16))
    for row, column in np.ndindex(16, 16):
        dx, dy = column * pitch + x - place[0], row * pitch + y - place[1]
        along, across = dx * np.cos(angle) + dy * np.sin(angle), dy * np.cos(angle) - dx * np.sin(angle)
        shape = 3 * ((along / half[0]) ** 2 + (across / half[1]) ** 2)
        for number in np.flatnonzero(depths > shape.min()):
            forces[number, row, column] = touching(give, depths[number] - shape).sum()
    thresholds = cover.switch.force_n * (1 + cover.switch.spread * rng.standard_normal((16, 16)))
    until = np.searchsorted(forces.sum(axis=(1, 2)), rng.uniform(4, 20)) + 1
    times = depths / rng.uniform(*scores.APPROACH_MM_S)
    return places.crossings(times[:until], forces[:until], thresholds)[None], tuple(place.tolist())


@pytest.mark.parametrize("tilts", [False, True])
def test_finite_elements_are_placed_better_than_by_the_barycenter(fitted, tilts):
    rng, found = np.random.default_rng(53 + tilts), []
    for _ in range(60):
        closing_s, place = element_touch(rng, tilts)
        tracker = Tracker(places=fitted)
        for zones in scores.frames(closing_s, scores.HZ):
            said = tracker.update(zones)
        found += scores.judged(said, [place])
    one = scores.mean(found)
    assert one.ratio + one.half < 0.9
    assert one.covered > 0.9


def test_touches_in_place_are_not_flagged_and_slides_and_fast_rolls_are(fitted, monkeypatch):
    monkeypatch.setattr(scores, "table", lambda levels=(1.0,): fitted)
    still, bar = (scores.mean(scores.grown(case, n)[-1] for n in range(40)) for case in scores.GROWING[0:7:6])
    slid, rolled = (scores.mean(scores.moved(case, number)[-1] for number in range(6)) for case in scores.MOVING[1::4])
    assert still.ratio + still.half < 0.7
    assert min(still.covered, bar.covered) > 0.87
    radii_mm = [np.sqrt(6 * spread.one_mm2 * 8**spread.power) for spread in fitted.spreads]
    assert 0.7 < radii_mm[5] < 1.7 < radii_mm[2] < 2.5 < radii_mm[4] < radii_mm[1]  # of eight cells
    assert (still.moved, slid.moved, rolled.moved) == (0.0, 1.0, 1.0)


def test_the_command_writes_what_a_tracker_takes(tmp_path, run):
    status, said, _ = run("cover", "places", "--kit", "starter", "--touches", 100, "-o", tmp_path / "places.toml")
    assert status == 0
    assert "places.toml" in said
    made = Places.load(tmp_path / "places.toml")
    assert [row.cells for row in made.rows[:5]] == [1, 2, 3, 4, 5]
    made.check(kits.kit("fast").skin.sheet)
    assert load_cover(kits.kit("fast").skin_path) == scores.cover()
