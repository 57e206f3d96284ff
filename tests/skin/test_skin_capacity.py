"""How many zones a Skin has room for."""

import numpy as np
import pytest

from contactfpga import Skin, SkinError

LONG = {"settle_us": 1000.0}  # no row too short for what the rest asks of it


# ---- capacity


@pytest.mark.parametrize(
    ("rows", "columns", "connectivity", "capacity"),
    [
        (1, 1, 8, 1),
        (16, 16, 8, 64),
        (16, 16, 4, 128),
        (32, 32, 8, 256),
        (32, 32, 4, 512),
        (33, 32, 8, 256),
        (33, 32, 4, 256),
        (64, 64, 8, 256),
        (64, 1, 8, 32),
        (5, 7, 8, 12),
        (5, 7, 4, 18),
    ],
)
def test_default_capacity(rows, columns, connectivity, capacity):
    skin = Skin(rows=rows, columns=columns, connectivity=connectivity, **LONG)
    assert skin.zone_capacity == capacity


@pytest.mark.parametrize("connectivity", [4, 8])
def test_max_zones_is_what_the_worst_frame_of_a_small_sheet_holds(connectivity):
    """Every frame of every sheet up to 3x4, labelled by scipy."""
    ndimage = pytest.importorskip("scipy.ndimage")
    structure = ndimage.generate_binary_structure(2, 1 if connectivity == 4 else 2)
    for rows in range(1, 4):
        for columns in range(1, 5):
            words = np.arange(1 << rows * columns)[:, None] >> np.arange(rows * columns) & 1
            most = max(ndimage.label(word.reshape(rows, columns), structure)[1] for word in words)
            assert Skin(rows=rows, columns=columns, connectivity=connectivity, **LONG).max_zones() == most


@pytest.mark.parametrize(("size", "connectivity", "capacity"), [(6, 8, 9), (16, 8, 64), (16, 4, 64), (64, 8, 64)])
def test_default_capacity_where_zones_are_divided(size, connectivity, capacity):
    skin = Skin(rows=size, columns=size, connectivity=connectivity, report="barycenter", **LONG)
    assert skin.zone_capacity == capacity


def test_replace_gives_a_skin_that_begins_or_ends_to_divide_its_own_capacity():
    skin = Skin(rows=32, columns=32, **LONG)
    divided = skin.replace(report="barycenter")
    assert (skin.zone_capacity, divided.zone_capacity) == (256, 64)
    assert divided.replace(report="cells") == skin.replace(report="cells")
    assert skin.replace(zone_capacity=7).replace(report="cells").zone_capacity == 7
    assert divided.replace(zone_capacity=7).replace(barycenter_bits=2).zone_capacity == 7


def test_replace_gives_a_changed_sheet_its_own_capacity():
    assert Skin(zone_capacity=7).replace(settle_us=6.0).zone_capacity == 7
    assert Skin(zone_capacity=7).replace(rows=8).zone_capacity == 32
    assert Skin().replace(rows=8, zone_capacity=3).zone_capacity == 3
    with pytest.raises(SkinError, match="rows is 65"):
        Skin().replace(rows=65)
