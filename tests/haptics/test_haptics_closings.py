"""Closings from frames: which switch closed, at which push, by exact sums and by cells."""

import pytest
from bumpers import flat, shown

from contactfpga.robot.haptics import ClosingWatch, HapticsError, LoadCells, Plane
from contactfpga.skin import Skin

SKIN = Skin(rows=8, columns=8)
CELLS = LoadCells(flat().units, surface=Plane())


def watched(*frames, bitmap=False):
    """A watch after frames of (cells, push)."""
    watch = ClosingWatch(CELLS)
    for sequence, (pressed, push) in enumerate(frames):
        watch.take(shown(SKIN.replace(report="cells") if bitmap else SKIN, pressed, sequence, push))
    return watch


def test_each_switch_has_the_push_at_which_its_row_was_scanned():
    watch = watched(([], 1.0), ([(2, 3)], 3.0), ([(2, 3), (4, 3)], 7.0))
    assert watch.complete
    assert watch.cells == [(2, 3), (4, 3)]
    # Rows come one after the other: halfway between two scans, and row / rows of the frame later.
    assert [one.force_n for one in watch.closings] == pytest.approx([1 + 2 * (0.5 + 2 / 8), 3 + 4 * (0.5 + 4 / 8)])
    assert watch.push_n == pytest.approx(7.0)


def test_a_switch_that_opens_is_forgotten_and_a_contact_that_ends_all_of_them():
    two = ([(2, 3), (2, 4)], 5.0)
    watch = watched(([], 1.0), ([(2, 3)], 3.0), two, ([(2, 4)], 4.0))
    assert watch.cells == [(2, 4)]
    assert watch.complete
    watch.take(shown(SKIN, [], 4, 0.5))
    assert (watch.cells, watch.complete) == ([], True)


def test_two_at_once_are_the_most_compact_pair():
    for pair in ([(3, 3), (4, 3)], [(3, 3), (3, 4)]):
        watch = watched(([], 1.0), (pair, 3.0))
        assert (watch.cells, watch.complete) == (pair, True)
    watch = watched(([], 1.0), ([(3, 3)], 2.0), ([(3, 3), (3, 4), (4, 3)], 4.0))
    assert watch.cells == [(3, 3), (3, 4), (4, 3)]


@pytest.mark.parametrize("bitmap", [False, True])
def test_two_pairs_with_the_same_sums_are_told_apart_by_cells_only(bitmap):
    watch = watched(([], 1.0), ([(3, 3), (4, 4)], 3.0), bitmap=bitmap)  # or (3, 4) and (4, 3)
    assert watch.complete is bitmap
    assert watch.cells == ([(3, 3), (4, 4)] if bitmap else [])


def test_a_contact_that_was_there_at_first_is_not_complete():
    watch = watched(([(3, 3)], 3.0), ([(3, 3), (3, 4)], 5.0))
    assert not watch.complete


def test_a_switch_without_a_push_is_not_known():
    assert not watched(([], None), ([(3, 3)], None)).complete


def test_a_watch_needs_a_surface():
    with pytest.raises(HapticsError, match="surface is missing"):
        ClosingWatch(flat())
