"""Contacts in maps of levels, against the tree of parts by scipy. No other test kills a part that lasts one level too
few or too many, a zone shared by order in place of distance, or a layer that is left out of a barycenter."""

import itertools
import tracemalloc

import numpy as np
import pytest
from scipy import ndimage
from zone_oracles import counted

from contactfpga.zones import labels, levels


@pytest.mark.parametrize("connectivity", [4, 8])
@pytest.mark.parametrize(("shape", "top"), [((1, 5), 3), ((2, 3), 2)])
def test_all_small_maps(shape, top, connectivity):
    for values in itertools.product(range(top + 1), repeat=shape[0] * shape[1]):
        read = np.array(values).reshape(shape)
        for lasts in range(1, top):
            assert levels.label(read, connectivity, lasts).max() == counted(read, connectivity, lasts), (read, lasts)


def test_random_maps_are_parted_within_their_zones(rng):
    random = np.random.default_rng(rng.getrandbits(32))
    several = 0
    for _ in range(300):
        read = ndimage.zoom(random.integers(0, 6, random.integers(2, 6, 2)), 3, order=1).clip(0, 4)
        connectivity, lasts = random.choice([4, 8]), random.integers(1, 4)
        found, zones = levels.label(read, connectivity, lasts), labels.label(read > 0, connectivity)
        assert ((found > 0) == (read > 0)).all()
        assert set(found.ravel()) - {0} == set(range(1, found.max() + 1))
        assert found.max() == counted(read, connectivity, lasts)
        assert all(len(set(zones[found == one])) == 1 for one in range(1, found.max() + 1))
        several += found.max() > zones.max()
    assert several > 30


@pytest.mark.parametrize("connectivity", [4, 8])
def test_one_level_gives_the_zones(rng, connectivity):
    random = np.random.default_rng(rng.getrandbits(32))
    for _ in range(100):
        cells = random.random((8, 9)) < random.random()
        for lasts in (1, 3):
            found = levels.label(cells.astype(int), connectivity, lasts)
            assert (found == labels.label(cells, connectivity)).all()
            area = levels.moments(cells.astype(int), found)
            assert (area[:, 1:] == labels.moments(found)).all()
            assert (area[:, 0] == area[:, 1]).all()


def test_cells_belong_to_the_nearest_part():
    assert levels.label(np.array([[3, 1, 1, 1, 1, 1, 2, 2, 3]]), 4, 1).tolist() == [[1, 1, 1, 1, 2, 2, 2, 2, 2]]
    around = np.array([[4, 1, 1, 1, 1], [1, 0, 0, 0, 1], [1, 1, 4, 0, 1]])
    assert levels.label(around, 4, 2).tolist() == [[1, 1, 1, 2, 2], [1, 0, 0, 0, 2], [1, 2, 2, 0, 2]]


def test_a_hostile_map_is_shared_by_distance_in_little_memory(rng):
    """The first of equally near parts in row-major order takes a cell; 64x64 cells with 1,024 parts take a few MB."""
    random = np.random.default_rng(rng.getrandbits(32))
    for _ in range(50):
        read = np.where(random.random(random.integers(1, 9, 2)) < 0.2, 3, 1)
        peaks = np.argwhere(read == 3)
        found, alone = levels.label(read, 4, 2), labels.label(read == 3, 4)
        if alone.max() > 1:
            near = [peaks[np.square(peaks - cell).sum(axis=1).argmin()] for cell in np.argwhere(read)]
            same = {(part, alone[tuple(seed)]) for part, seed in zip(found.ravel(), near)}
            assert len(same) == found.max() == alone.max()
    read = np.ones((64, 64), np.int64)
    read[::2, ::2] = 3
    tracemalloc.start()
    assert levels.label(read, 4, 2).max() == 1024
    assert tracemalloc.get_traced_memory()[1] < 12e6
    tracemalloc.stop()


def test_moments_are_those_of_the_layers():
    read = np.array([[1, 3, 1, 0], [0, 2, 1, 2], [0, 0, 0, 2]])
    found = levels.label(read, 4, 1)
    assert found.tolist() == [[1, 1, 1, 0], [0, 1, 1, 2], [0, 0, 0, 2]]
    layers = sum(labels.moments(np.where(read >= level, found, 0)) for level in (1, 2))
    layers[0] += labels.moments(np.where(read >= 3, found, 0))[0]
    assert levels.moments(read, found)[:, 1:].tolist() == layers.tolist()
    assert levels.moments(read, found)[:, 0].tolist() == [5, 2]


def test_an_untouched_map_has_no_contacts():
    found = levels.label(np.zeros((3, 4), int), 4, 1)
    assert found.shape == (3, 4)
    assert len(levels.moments(np.zeros((3, 4), int), found)) == 0
