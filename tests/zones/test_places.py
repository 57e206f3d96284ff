"""Places of zones by a table: what it says, and files that are none."""

import dataclasses

import numpy as np
import pytest

from contactfpga.zones.places import PlaceTable
from contactfpga.zones.zone import Zone

PITCH = np.array([10.0, 5.0])
KEYS = np.array([(1, 0, 0), (3, 1, 2)])
OFFSETS = np.array([(0.0, 0.0), (1.5, -0.5)])
TABLE = PlaceTable(PITCH, KEYS, OFFSETS)


def zone(area, sum_x, sum_y):
    return Zone(area, sum_x, sum_y, area * 50.0, sum_x / area * 10, sum_y / area * 5, None, None)


def test_a_zone_that_is_known_is_moved_wherever_it_lies():
    for right, down in ((0, 0), (4, 7), (11, 2)):
        sum_x, sum_y = 1 + 3 * right, 2 + 3 * down
        assert TABLE.place_mm(zone(3, sum_x, sum_y)) == pytest.approx((sum_x / 3 * 10 + 1.5, sum_y / 3 * 5 - 0.5))


def test_others_stay_where_their_barycenter_is():
    assert TABLE.place_mm(zone(3, 2, 2)) == pytest.approx((20 / 3, 10 / 3))
    divided = dataclasses.replace(zone(3, 1, 2), sum_x=None, sum_y=None)
    assert TABLE.place_mm(divided) == (divided.x_mm, divided.y_mm)
    assert TABLE.place_mm(dataclasses.replace(divided, x_mm=None)) is None


def test_a_zone_of_another_pitch_is_refused():
    with pytest.raises(ValueError, match="the table is for a pitch of 10 by 5 mm; the zone comes from another sheet"):
        TABLE.place_mm(dataclasses.replace(zone(3, 1, 2), area_mm2=300.0))


def test_a_table_is_read_as_it_was_written(tmp_path):
    TABLE.save(tmp_path / "places.npz")
    back = PlaceTable.load(tmp_path / "places.npz")
    for name in ("pitch_mm", "keys", "offsets_mm"):
        assert np.array_equal(getattr(back, name), getattr(TABLE, name))
    assert back.place_mm(zone(3, 1, 2)) == TABLE.place_mm(zone(3, 1, 2))


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"keys": KEYS[:, :2]}, r"keys have shape \(2, 2\) of int64"),
        ({"keys": KEYS.astype(float)}, r"keys have shape \(2, 3\) of float64"),
        ({"keys": np.array([(1, 0, 0), (3, 3, 0)])}, "keys must be an area above 0"),
        ({"keys": np.array([(1, 0, 0), (0, 0, 0)])}, "keys must be an area above 0"),
        ({"offsets_mm": OFFSETS[:1]}, r"offsets_mm have shape \(1, 2\); \(2, 2\) finite numbers"),
        ({"offsets_mm": OFFSETS * np.nan}, "offsets_mm have shape"),
        ({"pitch_mm": np.array([1.0])}, "pitch_mm must be two lengths above 0"),
        ({"pitch_mm": np.array([1.0, -1.0])}, "pitch_mm must be two lengths above 0"),
        ({"pitch_mm": None}, "has no array `pitch_mm`"),
        ({"keys": np.array([None])}, "holds object; bools or numbers"),
    ],
)
def test_a_file_that_is_no_table_is_refused_in_one_line(tmp_path, wrong, message):
    arrays = {"keys": KEYS, "offsets_mm": OFFSETS, "pitch_mm": PITCH} | wrong
    np.savez(tmp_path / "places.npz", **{name: one for name, one in arrays.items() if one is not None})
    with pytest.raises(ValueError, match=message) as caught:
        PlaceTable.load(tmp_path / "places.npz")
    assert "\n" not in str(caught.value)
    assert "places.npz" in str(caught.value)


def test_any_bytes_are_refused(tmp_path):
    (tmp_path / "places.npz").write_bytes(b"PK\x03\x04 and no more")
    with pytest.raises(ValueError, match=r"is no \.npy or \.npz file, or damaged"):
        PlaceTable.load(tmp_path / "places.npz")
