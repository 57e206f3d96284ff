"""Places on plane, cylinder and cone: distances, normals, the way back."""

from __future__ import annotations

import math

import numpy as np
import pytest

from contactfpga import Skin, surfaces
from contactfpga.surfaces import Cone, CylinderSurface, MirroredSurface, PlaneSurface, SurfaceError

ALL = [PlaneSurface(), PlaneSurface(12.5), CylinderSurface(38.0), Cone(40.0, 0.15), Cone(40.0, -0.15), Cone(5.0, 3.0)]
MIRRORED = [MirroredSurface(PlaneSurface(), 35.0), MirroredSurface(Cone(40.0, 0.15), 35.0)]
PLACES = [(0.0, 0.0), (10.0, 25.0), (-33.0, 7.0), (55.0, 90.0), (3.0, -2.0)]


@pytest.mark.parametrize("surface", ALL, ids=str)
@pytest.mark.parametrize("place", PLACES)
def test_sheet_is_neither_stretched_nor_turned(surface, place):
    """Steps along x and y are as long on the surface, at a right angle, and the normal is their cross product."""
    x, y = place
    step = 1e-4

    def point(dx: float, dy: float) -> np.ndarray:
        return np.array(surface.place(x + dx, y + dy)[0])

    along_x = (point(step, 0) - point(-step, 0)) / (2 * step)
    along_y = (point(0, step) - point(0, -step)) / (2 * step)
    assert np.linalg.norm(along_x) == pytest.approx(1, abs=1e-6)
    assert np.linalg.norm(along_y) == pytest.approx(1, abs=1e-6)
    assert along_x @ along_y == pytest.approx(0, abs=1e-6)
    assert np.cross(along_x, along_y) == pytest.approx(np.array(surface.place(x, y)[1]), abs=1e-6)


@pytest.mark.parametrize("surface", ALL + MIRRORED, ids=str)
@pytest.mark.parametrize("off_mm", [0.0, 2.0, -1.0])
def test_flat_undoes_place_also_off_the_surface(surface, off_mm):
    for x, y in PLACES:
        point, normal = surface.place(x, y)
        near = tuple(p + off_mm * n for p, n in zip(point, normal))
        assert surface.flat(near) == pytest.approx((x, y), abs=1e-9)


@pytest.mark.parametrize("surface", ALL + MIRRORED, ids=str)
def test_arrays_say_the_same_as_single_places(surface):
    x, y = np.array([[1.0, -2.5, math.nan], [40.0, 7.0, 3.0]]), np.array([[3.0, 50.0, 1.0], [0.0, math.nan, 2.0]])
    points, normals = surface.place(x, y)
    assert points.shape == normals.shape == (2, 3, 3)
    for index in np.ndindex(2, 3):
        if math.isnan(x[index] + y[index]):
            assert np.isnan(points[index]).all()
            assert np.isnan(normals[index]).all()
        else:
            point, normal = surface.place(float(x[index]), float(y[index]))
            assert tuple(points[index]) == point
            assert tuple(normals[index]) == normal


def test_cone_has_its_radius_and_slope():
    assert Cone(40.0, 0.15).place(0.0, 0.0)[0] == pytest.approx((40, 0, 0))
    (x, y, z), (_, _, up) = Cone(40.0, 0.15).place(0.0, 100.0)
    assert (x - 40) / z == pytest.approx(0.15)
    assert (y, up < 0) == (pytest.approx(0), True)


def test_mirrored_columns_count_from_the_other_end():
    assert MirroredSurface(CylinderSurface(38.0), 35.0).place(10.0, 7.0) == CylinderSurface(38.0).place(25.0, 7.0)


def test_surface_of_a_skin():
    assert surfaces.of(Skin().sheet) == PlaneSurface()
    assert surfaces.of(Skin(surface="cylinder", radius_mm=38.0).sheet) == CylinderSurface(38.0)


@pytest.mark.parametrize(
    ("make", "says"),
    [
        (lambda: CylinderSurface(0.0), "radius_mm is 0.0; it must be a number above 0 and at most 1e+06 mm"),
        (lambda: Cone(-1.0, 0.1), "radius_mm is -1.0; it must be a number above 0 and at most 1e+06 mm"),
        (lambda: Cone(10.0, 0.0), "slope is 0; a cone without a slope is a cylinder: use that"),
        (lambda: PlaneSurface(math.inf), "height_mm is inf; it must be a number above -1e+06 and at most 1e+06 mm"),
        (lambda: Cone(10.0, 1.0).place(0.0, -20.0), "y is -20 mm; the cone's tip is at -14.1421 mm"),
    ],
)
def test_what_cannot_be_is_refused_in_one_line(make, says):
    with pytest.raises(SurfaceError) as error:
        make()
    assert str(error.value) == says
