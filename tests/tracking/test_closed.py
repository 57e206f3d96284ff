"""Contacts on a sheet whose ends meet: the seam is no edge for them."""

import numpy as np
import pytest
from tracker_frames import events, ids

from contactfpga import Skin, Tracker, Zones
from contactfpga.wire.protocol import Frame, no_records

SKIN = Skin(rows=8, columns=24, surface="cylinder", radius_mm=40.0, closed=True, report="cells")


def pressed(time_us, cells, skin=SKIN):
    frame = Frame(0, time_us % (1 << 24), frozenset(), 0, 0, 0, int(cells.sum()), no_records(skin.sheet), cells)
    return Zones(frame, skin.sheet, time_us)


def finger(column, row=3):
    cells = np.zeros((SKIN.rows, SKIN.columns), bool)
    cells[row : row + 2, [int(column) % SKIN.columns, (int(column) + 1) % SKIN.columns]] = True
    return cells


@pytest.mark.parametrize("way", [1, -1])
def test_a_finger_that_goes_around_twice_stays_one_contact(way):
    tracker = Tracker()
    said = [tracker.update(pressed(1000 * step, finger(way * step / 10))) for step in range(10 * 2 * SKIN.columns)]
    assert {kind for kind, _ in events(said)} == {"down", "move"}
    assert all(ids(tracks) == [1] for tracks in said)
    speeds = [tracks.active[0].vx_mm_s for tracks in said[100:]]
    assert np.mean(speeds) == pytest.approx(way * 100 * SKIN.pitch_x_mm, rel=0.05)
    assert np.sign(speeds).tolist() == [way] * len(speeds)


def test_two_fingers_meet_and_part_over_the_seam():
    tracker, said = Tracker(), []
    for step in range(200):
        apart = abs(100 - step) / 20  # columns to either side of the seam, there and back
        cells = finger(SKIN.columns - 1 - apart - 1) | finger(apart)
        said.append(tracker.update(pressed(1000 * step, cells)))
    assert [kind for kind, _ in events(said) if kind != "move"] == ["down", "down", "merge", "split"]
    assert sorted(ids(said[0])) == sorted(ids(said[-1])) == [1, 2]
    assert ids(said[0]) == ids(said[-1])  # each on its own side


def test_a_ring_ends_no_contact_and_begins_none():
    """A hand around the cylinder has no place along it, and what it hides is still there."""
    ring = np.zeros((SKIN.rows, SKIN.columns), bool)
    ring[3:5] = True
    assert pressed(0, ring)[0].winding == "ring"
    tracker = Tracker()
    alone = tracker.update(pressed(0, ring))
    assert (alone.active, alone.events, len(alone.unsure)) == ((), (), 1)
    said = [tracker.update(pressed(1000 * step, finger(5) if step < 10 else ring)) for step in range(1, 400)]
    assert events(said) == [("down", 1)]
    assert [track.held for track in said[-1].active] == [True]
    back = [tracker.update(pressed(400_000 + 1000 * step, finger(5))) for step in range(20)]
    assert (events(back), ids(back[-1])) == ([], [1])
    gone = [tracker.update(pressed(500_000 + 1000 * step, np.zeros_like(ring))) for step in range(20)]
    assert events(gone) == [("up", 1)]
