"""Zones as the user sees them: order, mm, points and normals, the numpy view."""

import io
import json
import math
import random
from types import SimpleNamespace

import numpy as np
import pytest
from rich.console import Console
from wire import Wire
from zone_oracles import zones_by_scipy

import contactfpga
from contactfpga.driver.conversation import Conversation
from contactfpga.driver.stats import Stats
from contactfpga.zones import labels
from contactfpga.zones.batch import Batch
from contactfpga.zones.zone import DTYPE
from contactfpga_sim.model import golden
from contactfpga_sim.model.scenes.shapes import variants

SKIN = contactfpga.Skin(rows=12, columns=20, pitch_x_mm=4.0, pitch_y_mm=7.5, settle_us=20.0)
RADIUS_MM = 40.0
CYLINDER = SKIN.replace(surface="cylinder", radius_mm=RADIUS_MM)


def zones_of(moments, skin=SKIN, **options):
    host, wire = Conversation("x"), Wire(skin)
    host.receive(wire.hello(sent=options.get("sequence", 0)), 0.0)
    ((zones,),) = host.receive(wire.zones(moments, **options), 0.0)
    return zones


def test_area_and_barycenter_in_mm():
    (zone,) = zones_of([(4, 34, 6)])
    assert (zone.area_cells, zone.sum_x, zone.sum_y) == (4, 34, 6)
    assert (zone.area_mm2, zone.x_mm, zone.y_mm) == (4 * 4.0 * 7.5, 34 / 4 * 4.0, 6 / 4 * 7.5)


def test_sorted_by_y_then_x_then_area():
    rng = random.Random(1)
    moments = [(2, 2, 4), (1, 1, 2), (1, 7, 2), (3, 3, 6), (1, 19, 0), (2, 22, 0), (1, 0, 11)]
    for _ in range(20):
        rng.shuffle(moments)
        zones = zones_of(moments)
        order = [(zone.y_mm, zone.x_mm, zone.area_cells) for zone in zones]
        assert order == sorted(order)
        assert [zone.area_cells for zone in zones] == [2, 1, 1, 2, 3, 1, 1]


def test_a_plane_lies_at_z_0():
    (zone,) = zones_of([(1, 5, 3)])
    assert zone.point_mm == (20.0, 22.5, 0.0)
    assert zone.normal == (0.0, 0.0, 1.0)


def test_a_cylinder_has_its_axis_in_z():
    """A quarter of the circumference along x turns the x axis into the y axis."""
    quarter = CYLINDER.replace(pitch_x_mm=RADIUS_MM * math.pi / 2 / 10)
    first, last = zones_of([(1, 0, 0), (2, 20, 6)], quarter)
    assert first.point_mm == (RADIUS_MM, 0.0, 0.0)
    assert first.normal == (1.0, 0.0, 0.0)
    assert last.point_mm == pytest.approx((0.0, RADIUS_MM, 22.5), abs=1e-12)
    assert last.normal == pytest.approx((0.0, 1.0, 0.0), abs=1e-12)


def test_points_of_a_cylinder_lie_on_it_with_normals_that_point_outwards():
    rng = random.Random(2)
    for _ in range(100):
        area = rng.randrange(1, 200)
        (zone,) = zones_of([(area, rng.randrange(area * 19 + 1), rng.randrange(area * 11 + 1))], CYLINDER)
        x, y, z = zone.point_mm
        assert math.hypot(x, y) == pytest.approx(RADIUS_MM)
        assert z == zone.y_mm
        assert np.array(zone.normal) == pytest.approx(np.array([x, y, 0.0]) / RADIUS_MM)
        assert math.atan2(y, x) % (2 * math.pi) == pytest.approx(zone.x_mm / RADIUS_MM)


def test_neighbors_on_a_cylinder_are_a_pitch_apart_along_the_surface():
    """The barycenter is taken on the unwrapped sheet: a wide zone's point lies on the surface, not in the link."""
    (wide,) = zones_of([(20, sum(range(20)), 0)], CYLINDER)
    assert math.hypot(*wide.point_mm[:2]) == pytest.approx(RADIUS_MM)
    one, other = zones_of([(1, 3, 0), (1, 4, 0)], CYLINDER)
    assert math.dist(one.point_mm, other.point_mm) == pytest.approx(2 * RADIUS_MM * math.sin(4.0 / RADIUS_MM / 2))


def test_the_array_holds_the_zones_and_cannot_be_changed():
    zones = zones_of([(4, 34, 6), (1, 2, 11), (3, 30, 3)], CYLINDER)
    array = zones.array
    assert array.dtype == DTYPE
    assert len(array) == len(zones) == 3
    for row, zone in zip(array, zones, strict=True):
        for name in DTYPE.names:
            assert np.array_equal(row[name], getattr(zone, name)), name
    with pytest.raises(ValueError, match="read-only"):
        array["x_mm"] = 0


def test_no_zone_is_an_empty_sequence():
    zones = zones_of([])
    assert len(zones) == 0
    assert list(zones) == []
    assert zones.array.shape == (0,)
    assert zones.pressed == 0
    assert zones.cells is None


def test_zones_are_a_sequence():
    zones = zones_of([(1, 0, 0), (1, 0, 2), (1, 0, 4)])
    assert zones[0].y_mm == 0.0
    assert zones[-1].y_mm == 30.0
    assert zones[1:] == tuple(zones)[1:]
    assert zones[2] in zones
    assert next(reversed(zones)) == zones[2]
    with pytest.raises(IndexError):
        zones[3]


def test_a_zone_does_not_change():
    (zone,) = zones_of([(1, 0, 0)])
    with pytest.raises(AttributeError):
        zone.x_mm = 1.0
    assert not hasattr(zone, "__dict__")


def test_the_text_names_what_matters():
    zones = zones_of([(4, 34, 6)], sequence=7, time=1_500_000, flags=["fault"])
    text = repr(zones)
    assert "1 zone, 4 cells pressed, frame 7 at 1.500000 s, fault" in text
    assert "4 cells, 120 mm2 at x 34.00 mm, y 11.25 mm" in text
    assert str(zones) == text


def test_a_frame_flagged_mismatch_reaches_the_user_whatever_it_holds():
    """The board itself says that its records are wrong: they are shown, and the flag with them."""
    zones = zones_of([(0, 3, 3), (4, 34, 6)], cells=9, flags=["mismatch"])
    assert zones.flags == {"mismatch"}
    assert len(zones) == 2
    assert zones.pressed == 9
    first, last = zones
    assert (first.area_cells, first.x_mm) == (4, 34.0)
    assert (last.area_cells, last.x_mm, last.y_mm, last.point_mm, last.normal) == (0, None, None, None, None)
    assert np.isnan(zones.array["x_mm"]).tolist() == [False, True]
    assert "0 cells, 0 mm2 nowhere" in repr(zones)
    assert json.loads(json.dumps(zones.to_dict(), allow_nan=False))["zones"][1]["x_mm"] is None
    assert len(Batch.of([zones]).zones) == 2


@pytest.mark.parametrize("moments", [[(0, 3, 3)], [(1, 31, 15)], [(1, 200, 3)], [(255, 0, 0), (0, 0, 0)]])
def test_a_frame_flagged_mismatch_can_be_shown(moments):
    """Whatever the records hold: zones beyond the sheet are not drawn."""
    from contactfpga.tools.console.live import Room
    from contactfpga.tools.console.views import zones_view

    zones = zones_of(moments, cells=9, flags=["mismatch"])
    board = SimpleNamespace(port="x", stats=Stats(), skin=SKIN)
    console = Console(file=io.StringIO(), width=200)
    console.print(zones_view(board, zones, Room(console, 200, None, True)))
    assert "mismatch" in console.file.getvalue()


@pytest.mark.parametrize(("turned", "name"), [(16, "ring"), (511, "wound")])
def test_the_table_says_why_a_zone_has_no_x(turned, name):
    from contactfpga.tools.console.views import table

    skin = contactfpga.Skin(surface="cylinder", radius_mm=40.0, closed=True)
    host, wire = Conversation("x"), Wire(skin)
    host.receive(wire.hello(), 0.0)
    ((zones,),) = host.receive(wire.zones([(16, 120, 80, turned)]), 0.0)
    console = Console(file=io.StringIO(), width=200)
    console.print(table(zones))
    assert console.file.getvalue().splitlines()[-2].split()[1:-1:2] == ["16", "2513.27", name, "50.00"]


# ---- cells


@pytest.mark.parametrize("connectivity", [4, 8])
def test_zones_of_cells_are_found_on_the_host_as_scipy_finds_them(rng, connectivity):
    for _ in range(150):
        rows, columns = rng.randrange(1, 25), rng.randrange(1, 25)
        skin = contactfpga.Skin(rows=rows, columns=columns, report="cells", connectivity=connectivity, settle_us=100.0)
        cells = np.array([[rng.random() < rng.choice([0.3, 0.6]) for _ in range(columns)] for _ in range(rows)])
        host, wire = Conversation("x"), Wire(skin)
        host.receive(wire.hello(), 0.0)
        ((zones,),) = host.receive(wire.cells(cells.tolist()), 0.0)
        expected = zones_by_scipy(cells, connectivity)
        assert zones.total_zones == len(zones) == len(expected)
        assert sorted((zone.area_cells, zone.sum_x, zone.sum_y) for zone in zones) == expected


@pytest.mark.parametrize("connectivity", [4, 8])
def test_the_host_finds_the_zones_that_the_golden_model_finds(connectivity):
    for _, cells in variants(12, 20):
        found = sorted(map(tuple, labels.moments(labels.label(cells, connectivity)).tolist()))
        assert found == sorted(golden.zones(cells, connectivity))
