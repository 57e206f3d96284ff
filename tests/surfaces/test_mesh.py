"""Surfaces of any shape: tables, and sheets laid on meshes whose shape is known."""

from __future__ import annotations

import json
import math
import os

import numpy as np
import pytest

from contactfpga.robot.body.kinematics import Pose
from contactfpga.surfaces import CylinderSurface, Mesh, SurfaceError
from contactfpga.surfaces.laying import Placement, Triangles
from contactfpga.tools import cli

trimesh = pytest.importorskip("trimesh")
POSE = Pose.of((20.0, -30.0, 5.0), (0.3, -0.4, 0.5))


@pytest.fixture(scope="module")
def tube(tmp_path_factory):
    """A cylinder of 45 mm radius about z, 300 mm long and round to 0.01 mm, moved to :data:`POSE`."""
    mesh = trimesh.creation.cylinder(radius=45, height=300, sections=200)
    moved = np.eye(4)
    moved[:3, :3], moved[:3, 3] = POSE.rotation, POSE.point_m
    mesh.apply_transform(moved)
    path = tmp_path_factory.mktemp("meshes") / "tube.stl"
    mesh.export(path)
    return path


@pytest.fixture(scope="module")
def ball(tmp_path_factory):
    path = tmp_path_factory.mktemp("meshes") / "ball.obj"
    trimesh.creation.icosphere(subdivisions=4, radius=100).export(path)
    return path


def laid(rows, columns, pitch_x_mm, pitch_y_mm, pose=POSE):
    return Placement(rows, columns, pitch_x_mm, pitch_y_mm, pose.rotation, pose.point_m)


def test_sheet_unrolled_on_a_tube_lies_as_on_a_cylinder(tube):
    table = laid(6, 16, 17.0, 10.0).unrolled(Triangles.load(tube))
    exact = CylinderSurface(45.0)
    x, y = np.meshgrid(np.linspace(0, 255, 40), np.linspace(0, 50, 11))
    points, normals = table.place(x, y)
    true_points, true_normals = exact.place(x, y)
    # Half a column from the nearest cells the chord is 17^2 / (8 * 45) mm under the arc.
    assert np.abs(points - POSE.apply(true_points)).max() < 17**2 / 8 / 45 * 1.1
    assert np.abs(normals - POSE.turn(true_normals)).max() < 0.02
    cells, _ = table.place(17.0 * np.arange(16), np.full(16, 20.0))
    assert np.abs(cells - POSE.apply(exact.place(17.0 * np.arange(16), np.full(16, 20.0))[0])).max() < 0.02


def test_closed_sheet_goes_all_the_way_round(tube):
    table = laid(4, 12, math.tau * 45 / 12, 10.0).unrolled(Triangles.load(tube), closed=True)
    (low, high), _ = table.spacing_mm
    assert (low, high) == (pytest.approx(90 * math.sin(math.pi / 12), abs=0.02),) * 2
    before, after = (table.place(table.pitch_x_mm * x, 15.0)[0] for x in (11.75, -0.25))
    assert before == pytest.approx(after)


def test_sheet_projected_on_a_ball_lies_straight_below(ball):
    table = laid(5, 5, 20.0, 20.0, Pose.of((-40.0, -40.0, 0.0))).projected(Triangles.load(ball))
    x, y = np.meshgrid(20.0 * np.arange(5), 20.0 * np.arange(5))
    points, normals = table.place(x, y)
    height = np.sqrt(100**2 - (x - 40) ** 2 - (y - 40) ** 2)
    assert np.abs(points - np.stack([x - 40, y - 40, height], axis=-1)).max() < 0.3
    assert np.abs(normals - points / 100).max() < 0.01


def test_scale_is_that_of_the_file(ball):
    assert Triangles.load(ball, 1000.0).size_mm == pytest.approx(1000 * (Triangles.load(ball).size_mm - 1) + 1)


@pytest.mark.parametrize("closed", [False, True])
def test_flat_finds_the_place_of_a_point(tube, closed):
    sheet = laid(6, 16, math.tau * 45 / 16 if closed else 17.0, 10.0)
    table = sheet.unrolled(Triangles.load(tube), closed=closed)
    for x, y in [(3.0, 2.0), (100.0, 44.0), (200.0, 25.0)]:
        point, normal = table.place(x, y)
        assert table.flat(point) == pytest.approx((x, y), abs=1e-6)
        off = tuple(p + 0.5 * n for p, n in zip(point, normal))
        assert table.flat(off) == pytest.approx((x, y), abs=0.3)


def test_single_places_and_arrays_agree_and_nowhere_stays_nowhere(ball):
    table = laid(5, 5, 20.0, 20.0, Pose.of((-40.0, -40.0, 0.0))).projected(Triangles.load(ball))
    x, y = np.array([0.0, 33.0, math.nan]), np.array([80.0, 12.5, 1.0])
    points, normals = table.place(x, y)
    assert np.isnan(points[2]).all()
    assert np.isnan(normals[2]).all()
    for index in (0, 1):
        point, normal = table.place(float(x[index]), float(y[index]))
        assert (point, normal) == (tuple(points[index]), tuple(normals[index]))


def test_command_writes_a_table_that_loads(tube, tmp_path, capsys):
    skin, table = tmp_path / "skin.toml", tmp_path / "table.npz"
    skin.write_text("rows = 6\ncolumns = 8\n")
    placed = ["--origin-mm", *map(str, POSE.point_m), "--rpy", "0.3", "-0.4", "0.5"]
    status = cli.main(["body", "surface", str(tube), str(table), "--skin", str(skin), *placed])
    assert (status, capsys.readouterr().out) == (
        0,
        f"{table}: 6x8 cells on 800 triangles\nneighbors lie 9.98 to 9.98 mm apart along rows (pitch 10), 10.00 to "
        "10.00 along columns (pitch 10)\n",
    )
    assert cli.main(["body", "surface", str(tube), str(table), "--skin", str(skin), *placed, "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    spacing_mm = pytest.approx(np.array([[9.98, 9.98], [10, 10]]), abs=0.01)
    assert np.array(answer.pop("spacing_mm")) == spacing_mm
    assert answer == {"file": str(table), "rows": 6, "columns": 8, "triangles": 800}
    read = Mesh.load(table)
    assert (read.lines, read.pitch_x_mm, read.closed) == ((6, 8), 10.0, False)
    assert read.place(0.0, 0.0)[0] == pytest.approx(tuple(POSE.apply(np.array([45.0, 0, 0]))), abs=0.02)


METERS = "the mesh spans 400 mm, the sheet 4500; a mesh in m needs --scale 1000"


@pytest.mark.parametrize(
    ("sheet", "by", "says"),
    [
        (laid(40, 8, 10.0, 10.0), "unrolled", "column 0 is 390 mm long; the mesh ends after 1"),
        (laid(4, 9, 500.0, 10.0), "unrolled", METERS),
        (laid(9, 4, 10.0, 500.0), "projected", METERS),
        (laid(4, 40, 10.0, 10.0), "unrolled", "row 0: 40 columns are longer than the 282.7 mm around it"),
        (laid(4, 4, 10.0, 10.0, Pose.of((0, 0, 999.0))), "unrolled", "column 0 does not meet the mesh at row 0"),
        (
            laid(4, 4, 10.0, 10.0, Pose.of((999.0, 0, 0))),
            "projected",
            "16 cells do not meet the mesh, among them row 0",
        ),
    ],
)
def test_sheet_off_the_mesh_is_refused(tube, sheet, by, says):
    with pytest.raises(SurfaceError) as error:
        getattr(sheet, by)(Triangles.load(tube))
    assert str(error.value).startswith(says)


def test_files_that_are_no_tables_or_meshes_are_refused_in_one_line(tmp_path, capsys):
    for name, data in (("a.npz", b"PK nothing"), ("b.npz", b""), ("c.stl", b"solid x"), ("d.txt", b""), ("e.obj", b"")):
        (tmp_path / name).write_bytes(data)
        with pytest.raises(SurfaceError) as error:
            Mesh.load(tmp_path / name) if name.endswith("npz") else Triangles.load(tmp_path / name)
        assert name in str(error.value)
        assert "\n" not in str(error.value)
    np.savez(
        tmp_path / "odd.npz", points_mm=np.zeros((2, 2, 3)), normals=np.zeros((2, 2, 3)), pitch_mm=[1, 1], closed=0
    )
    with pytest.raises(SurfaceError, match="the normal at row 0, column 0 has no direction"):
        Mesh.load(tmp_path / "odd.npz")
    np.savez(tmp_path / "object.npz", points_mm=np.array([{}], object))
    with pytest.raises(SurfaceError, match=r"not a table of `contactfpga body surface`"):
        Mesh.load(tmp_path / "object.npz")


def test_objects_are_read_however_they_are_written(tmp_path):
    """Indices are relative to the vertices so far: counted from the end, the first part would lie on the second."""
    parts = [trimesh.creation.box((size, size, 1)) for size in (10, 30)]
    text = "\ufeffv 7 7 7\n"
    for part in parts:
        text += "".join(f" \tv\t{x}  {y} {z} # 1 2\r\n" for x, y, z in part.vertices)
        text += "".join(f"f\t{a - 8}/1 {b - 8}//-1 \\\n{c - 8} # 9\n" for a, b, c in part.faces)
    (tmp_path / "parts.obj").write_text(f"{text}v nan inf 1e300\rf 2 3 5 4\n", encoding="utf-8")
    triangles = Triangles.load(tmp_path / "parts.obj").corners_mm
    quad = parts[0].vertices[[[0, 1, 3], [0, 3, 2]]]
    assert np.array_equal(triangles, np.concatenate([*(part.triangles for part in parts), quad]))


def test_the_name_of_a_solid_is_no_corner(tmp_path):
    (tmp_path / "vertex.stl").write_text(f"{SOLID.replace('solid a', 'solid vertex')}endsolid vertex\n")
    assert Triangles.load(tmp_path / "vertex.stl").corners_mm.tolist() == [[[0, 0, 0], [1, 0, 0], [0, 1, 0]]]


SOLID = "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\n"


@pytest.mark.parametrize(
    ("name", "data", "says"),
    [
        ("a.obj", b"v 1,5 2,5 0", "line 'v 1,5 2,5 0' must have three numbers with decimal points"),
        ("a.obj", b"v 0 0 0\nv 1 0 0\nf -1 -2 -3\nv 0 1 0", "a triangle has a corner that is none of its 3"),
        ("a.obj", b"v 0 0 0\nv 1 0 0\nf 0 1 2\nv 0 1 0", "a triangle has a corner that is none of its 3"),
        ("a.stl", SOLID.replace("1 0 0", "1,0 0 0").encode(), "line 'vertex 1,0 0 0' must have three numbers"),
        ("a.stl", f"{SOLID}endsolid\n{SOLID}".encode(), "it ends within a solid, so a part is missing"),
        ("a.stl", bytes(80) + b"\2\0\0\0" + bytes(103), "187 bytes; its 2 triangles would take 184; export it"),
    ],
)
def test_a_mesh_that_is_not_plain_is_refused_with_what_is_wrong(tmp_path, name, data, says):
    (tmp_path / name).write_bytes(data)
    with pytest.raises(SurfaceError) as error:
        Triangles.load(tmp_path / name)
    assert str(error.value).startswith(f"{tmp_path / name}: {says}")


def test_meshes_that_are_damaged_are_refused_without_a_traceback_of_their_reader(tube, tmp_path, python):
    """trimesh logs one where a mesh has triangles without an area."""
    data = bytearray(tube.read_bytes())
    data[84 + 12 : 84 + 16] = np.float32(np.nan).tobytes()
    (tmp_path / "nan.stl").write_bytes(data)
    with pytest.raises(SurfaceError, match=r"nan.stl: 1 of its \d+ triangles have a corner that is no point"):
        Triangles.load(tmp_path / "nan.stl")
    code = f"from contactfpga.surfaces.laying import Triangles; Triangles.load({str(tmp_path / 'flat.stl')!r})"
    data = bytearray(tube.read_bytes())
    data[84 + 24 : 84 + 36] = data[84 + 12 : 84 + 24]
    (tmp_path / "flat.stl").write_bytes(data)
    done = python(code)
    assert (done.returncode, done.stderr) == (0, "")
    os.mkfifo(tmp_path / "pipe.stl")
    with pytest.raises(OSError, match="not a regular file"):
        Triangles.load(tmp_path / "pipe.stl")
