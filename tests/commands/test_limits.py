"""What a file from a stranger may cost: memory and processor time are bounded, and a limit is reported in one line."""

import io
import time
import tomllib
import tracemalloc
import zipfile
from pathlib import Path

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from contactfpga import ContactFPGAError, Skin, SkinError
from contactfpga.design.cover.task import Task
from contactfpga.inputs import array_file, tomlfile, values, xmlfile
from contactfpga.robot.body import Body, BodyError, folds, robot_texts, urdf
from contactfpga.robot.body.folds import Folds
from contactfpga.robot.body.kinematics import Kinematics
from contactfpga.robot.haptics import LoadCells
from contactfpga.skin.several import MOST_SHEETS, Several
from contactfpga.surfaces import Mesh, SurfaceError, mesh, mesh_file
from contactfpga.surfaces.laying import Triangles
from contactfpga.tools.commands.haptics import reading
from contactfpga.tools.recordings import mcap
from contactfpga_sim.lab.arm.case import Case
from contactfpga_sim.model.scenes.file import SceneFile
from contactfpga_sim.model.scenes.recordings import Recording

DOTTED = f"a{'.a' * 300_000} = 1\n"
"""The standard library's parser takes the square of this."""
LONG_KEY = "a key has more than 16 parts with dots between; use shorter keys"


class Cost:
    """Seconds of this thread's processor, and the most bytes at a time, of what is done within."""

    def __enter__(self):
        tracemalloc.start()
        self._begun_s = time.thread_time()
        return self

    def __exit__(self, *_):
        self.cpu_s = time.thread_time() - self._begun_s
        self.peak = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()


# ---- TOML


@pytest.mark.parametrize(
    "read",
    [Skin.load, Body.load, robot_texts.pack, lambda path: robot_texts.unpack({robot_texts.TOML: DOTTED}, path.parent)],
)
def test_keys_of_many_parts_are_refused_before_they_are_parsed(tmp_path, read):
    path = tmp_path / "skin.toml"
    path.write_text(DOTTED)
    with Cost() as cost, pytest.raises((SkinError, BodyError), match=f": {LONG_KEY}$"):
        read(path)
    assert cost.cpu_s < 5


PARTS = st.sampled_from(["a", "b-1", "_", '"x.y"', '"\\""', "'#'", '"[.]"', '"a\\\\"', "1"])
TEXTS = st.text(st.sampled_from(list("ab.\"'#\\[]{}=,\n ")), max_size=40)


@st.composite
def documents(draw):
    """A TOML text, and the parts of its longest key."""
    lines, most = [], 0
    for number in range(draw(st.integers(1, 4))):
        parts = [f"k{number}", *draw(st.lists(PARTS, max_size=12) | st.lists(PARTS, min_size=16, max_size=20))]
        key = draw(st.sampled_from([".", " . ", "\t.", ". "])).join(parts)
        text, plain = draw(TEXTS), draw(TEXTS)
        quoted = text.replace("\\", "\\\\").replace('"', '\\"').replace("\n", "\\n")
        long = text.replace("\\", "\\\\").replace('"', '\\"')
        literal = plain.replace("'", "").replace("\n", "")
        given = [
            f'"{quoted}"', f"'{literal}'",
            f'"""{long}"""', f'"""a"x{long}x""\\""""', f"'''{plain.replace(chr(39), '')}'''",
            "1.5", "[1.5, 2.5, 3.5, -1e-3, 4.5, 1.5, 2.5, 1.5, 1.5, 1.5, 1.5, 1.5, 1.5, 1.5, 1.5, 1.5, 1.5, 1.5]",
            f"{{a.b = '{literal}', c = 1.5}}",
        ]  # fmt: skip
        comment = draw(st.sampled_from(["", f"  # {literal}", '  # """' + ".a" * 20]))
        lines.append(f"{key} = {draw(st.sampled_from(given))}{comment}\n")
        most = max(most, len(parts))
    return "".join(lines), most


@given(documents())
@example((f"k0{'.a' * 15} = 1\n", 16))
@example((f"k0{'.a' * 16} = 1\n", 17))
@example((f'k0 = """"""\nk1{".a" * 16} = ""\n', 17))  # Python 3.11.2 took all of it for one string
@settings(max_examples=150, deadline=None)
def test_only_keys_of_many_parts_are_refused(document):
    """Whatever stands in strings and comments; the parser says what a text is."""
    text, most = document
    known = tomllib.loads(text)
    if most > tomlfile.MAX_DEPTH:
        with pytest.raises(SkinError, match=LONG_KEY):
            tomlfile.parse(text.encode(), "x", SkinError)
    else:
        assert tomlfile.parse(text.encode(), "x", SkinError) == known


LONG = "q" * 900_000


@pytest.mark.parametrize(
    ("read", "text"),
    [
        (Skin.load, f'name = "{LONG}"'),
        (Skin.load, f"{LONG} = 1"),
        (Several.load, f"sheets = [{'1, ' * 300_000}]"),
        (Body.load, f'[[links]]\nname = "{LONG}"'),
        (SceneFile.load, f'[[contact]]\nshape = "{LONG}"'),
        (Case.load, f"{LONG} = 1"),
        (Task.load, f"{LONG} = 1"),
        (LoadCells.load, "[surface]\nkind = []"),
    ],
)
def test_messages_are_short(tmp_path, read, text):
    path = tmp_path / "x.toml"
    path.write_text(text)
    with pytest.raises(ContactFPGAError if read not in (SceneFile.load, Case.load) else ValueError) as refused:
        read(path)
    assert len(str(refused.value).replace(str(path), "")) < 700


@pytest.mark.parametrize("words", [["body", "show", "x.toml"], ["zones", f"--no-such-{LONG}"]], ids=["file", "option"])
def test_no_error_fills_the_screen(tmp_path, monkeypatch, run, words):
    """What the system says of a name is as long as that."""
    monkeypatch.chdir(tmp_path)
    Path("x.toml").write_text(f'[[links]]\nname = "a"\nskin = "{LONG}"')
    assert 0 < len(run(*words)[2]) < 10_000


@pytest.mark.parametrize(
    "arguments", [["replay", "x.npy", "--skin", "esc\x1b[2J"], ["zones", "\x1b[2J", "\u202eab"], ["\x1b]0;a\x07"]]
)
def test_what_the_parser_of_options_quotes_is_shown_as_escapes(run, arguments):
    _, out, errors = run(*arguments, "--no-such\x1b[2J")
    assert "\\x1b" in errors
    assert not any(one in out + errors for one in "\x1b\x07\u202e")


# ---- XML


def chain(links):
    joint = '<joint name="j{0}" type="revolute"><parent link="l{0}"/><child link="l{1}"/><origin xyz="0 0 1"/></joint>'
    inside = [f'<link name="l{number}"/>' for number in range(links)]
    inside += [joint.format(number, number + 1) for number in range(links - 1)]
    return f"<robot name='chain'>{''.join(inside)}</robot>"


def test_the_longest_chain_is_quick(tmp_path):
    path = tmp_path / "chain.urdf"
    path.write_text(chain(urdf.MAX_LINKS))
    angles = {f"j{number}": 0.0 for number in range(urdf.MAX_LINKS)}
    with Cost() as cost:
        kinematics = Kinematics(urdf.load(path))
        poses = kinematics.poses(angles)
    assert cost.cpu_s < 10
    last = f"l{urdf.MAX_LINKS - 1}"
    assert poses[last].point_m[2] == kinematics.pose(last, angles).point_m[2] == urdf.MAX_LINKS - 1
    assert len(poses) == urdf.MAX_LINKS


def hidden(encoding, mark=b""):
    """A document type in this encoding."""
    laughs = '<!DOCTYPE robot [<!ENTITY a "ha"><!ENTITY b "&a;&a;&a;">]><robot name="&b;"/>'
    return mark + f'<?xml version="1.0" encoding="{encoding[:6]}"?>{laughs}'.encode(encoding)


@pytest.mark.parametrize(
    ("data", "said"),
    [
        (chain(20_000).encode(), "20,000 links; the limit is 1,000$"),
        (b"<robot>" + b"<a/>" * (xmlfile.MAX_ELEMENTS + 1) + b"</robot>", "more than 100,000 elements"),
        (b"<robot>" + b"<!--" * 500_000, "not a URDF file"),
        *((hidden(one), "it declares a document type") for one in ("utf-8", "utf-16", "latin-1")),
        (hidden("utf-16-le", b"\xff\xfe"), "it declares a document type"),
        (hidden("utf-16-be", b"\xfe\xff"), "it declares a document type"),
        *(
            (f'<?xml version="1.0" encoding="{one}"?><robot/>'.encode(), "not a URDF file: [^\n]*$")
            for one in ("utf-7", "rot13", "no-such", "utf-32")
        ),
    ],
    ids=lambda value: str(value)[:40] if isinstance(value, str) else "",
)
def test_xml_beyond_a_limit_is_refused_in_one_line(tmp_path, data, said):
    """No encoding hides a document type."""
    path = tmp_path / "x.urdf"
    path.write_bytes(data)
    with Cost() as cost, pytest.raises(BodyError, match=f"^{path}: {said}"):
        urdf.load(path)
    assert cost.cpu_s < 10


@pytest.mark.parametrize("encoding", ["utf-8", "utf-16", "latin-1"])
def test_other_encodings_are_read(tmp_path, encoding):
    path = tmp_path / "x.urdf"
    text = f'<?xml version="1.0" encoding="{encoding}"?><robot name="Zoé"><link name="é"/></robot>'
    path.write_bytes(text.encode(encoding))
    assert urdf.load(path).links == ("é",)


# ---- meshes


def zipped(name, size):
    data = io.BytesIO()
    with zipfile.ZipFile(data, "w", zipfile.ZIP_DEFLATED, compresslevel=1) as archive:
        archive.writestr(name, bytes(size))
    return data.getvalue()


def triangles(corners, faces):
    """Bytes of a binary STL."""
    points = np.asarray(corners, "<f4")[np.asarray(faces)]
    data = b"".join(bytes(12) + face.tobytes() + bytes(2) for face in points)
    return bytes(80) + len(faces).to_bytes(4, "little") + data


DAE = """<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1"><library_visual_scenes>
<visual_scene id="s"><node id="n">{}</node></visual_scene></library_visual_scenes></COLLADA>"""


@pytest.mark.parametrize("name", ["b.zip", "b.stl", "b.obj", "b.dae", "b.3mf", "b.tar.gz", "b.glb"])
def test_archives_of_meshes_are_not_unpacked(tmp_path, name):
    """A robot's file may name any file."""
    pytest.importorskip("trimesh")
    path = tmp_path / name
    path.write_bytes(
        zipped("3D/3dmodel.model" if name.endswith("3mf") else "a.dae" if name == "b.dae" else "a.stl", 6 * 10**7)
    )
    with Cost() as cost, pytest.raises(SurfaceError, match=f"^{path}: "):
        mesh_file.read(path, "view", (*mesh_file.SUFFIXES, mesh_file.COLLADA))
    assert cost.peak < 50e6


@pytest.mark.parametrize(
    ("name", "data", "said"),
    [
        ("x.stl", bytes(mesh_file.MAX_BYTES + 1), "longer than 20,000,000 bytes"),
        ("x.obj", b"v 0 0 0\n" * 3 + b"f 1 2 3\n" * (mesh_file.MAX_TRIANGLES + 1), "500,001 triangles; the limit is"),
        ("x.obj", b"v 0 0 0\n" * 3 + b"f 1 2 9\n", "x.obj: "),
        ("x.dae", DAE.format('<instance_node url="#n"/>' * 2).encode(), "it shows a node at several places"),
        ("x.ply", b"0 " * 4_000_001, "4,000,001 words; the limit is 4,000,000. Write it as binary STL"),
        ("x.dae", DAE.format("0 " * 500_000 + '<instance_geometry url="#g"/>' * 5).encode(), "one part at 5 places"),
        ("x.dae", DAE.replace("xmlns", "xmlns:n").format('<n:instance_node url="#n"/>' * 2).encode(), "several places"),
        ("x.dae", DAE.format('<instance_geometry url="#g"/>' * 900).encode(), "it shows one part at 900 places"),
        ("x.dae", b"<!DOCTYPE x>" + DAE.encode(), "it declares a document type"),
    ],
)
def test_meshes_beyond_a_limit_are_refused(tmp_path, name, data, said):
    pytest.importorskip("trimesh")
    path = tmp_path / name
    path.write_bytes(data)
    with pytest.raises(SurfaceError) as refused:
        mesh_file.read(path, "view", (*mesh_file.SUFFIXES, mesh_file.COLLADA))
    assert said in str(refused.value)


def test_objects_of_thousands_of_groups_are_one_mesh(tmp_path):
    """The library would take minutes for them; materials beside the file are not looked for."""
    pytest.importorskip("trimesh")
    path = tmp_path / "x.obj"
    groups = "".join(f"o a{number}\nusemtl b{number}\nf 1/1 2/2/2 3//3\n" for number in range(10_000))
    path.write_text(f"mtllib /etc/passwd\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\n{groups}f 1 2 \\\n3\n")
    with Cost() as cost:
        assert len(mesh_file.read(path, "surface").faces) == 10_001
    assert cost.cpu_s < 5


def test_a_fan_of_very_many_triangles_is_refused(tmp_path):
    """The library keeps a table as wide as the busiest corner."""
    pytest.importorskip("trimesh")
    angles = np.linspace(0, 6, 8001)
    rim = np.stack([np.cos(angles), np.sin(angles), 0 * angles], axis=1)
    path = tmp_path / "fan.stl"
    path.write_bytes(triangles([[0, 0, 1], *rim], [(0, one, one + 1) for one in range(1, 8001)]))
    with Cost() as cost, pytest.raises(SurfaceError, match="8,000 of its 8,000 triangles share one corner"):
        Triangles.load(path)
    assert cost.peak < 100e6


# ---- arrays and tables of cells


@pytest.mark.parametrize("packing", [zipfile.ZIP_DEFLATED, zipfile.ZIP_BZIP2, zipfile.ZIP_LZMA])
def test_a_packed_array_is_unpacked_to_its_limit(tmp_path, packing):
    path = tmp_path / "x.npz"
    data = io.BytesIO()
    np.lib.format.write_array_header_1_0(data, {"descr": "|u1", "fortran_order": False, "shape": (4 * 10**7,)})
    with zipfile.ZipFile(path, "w", packing) as archive, archive.open("points_mm.npy", "w") as file:
        file.write(data.getvalue())
        for _ in range(40):
            file.write(bytes(10**6))
    with Cost() as cost, pytest.raises(SurfaceError, match=r"^[^\n]*(the limit is 98304, split it|numpy does not use)"):
        Mesh.load(path)
    assert cost.peak < 20e6


@pytest.mark.parametrize("shape", [(1 << 40,), (-1,), (1 << 20, 1 << 20), (3, 0, 1 << 62)])
def test_an_array_that_claims_more_than_it_has_is_refused(tmp_path, shape):
    path = tmp_path / "x.npy"
    with open(path, "wb") as file:
        np.lib.format.write_array_header_1_0(file, {"descr": "<f8", "fortran_order": False, "shape": shape})
        file.write(bytes(1000))
    with Cost() as cost, pytest.raises((array_file.ArrayFileError, ValueError)):
        Recording.load(path)
    assert cost.peak < 20e6


def test_arrays_of_objects_are_not_unpickled(tmp_path):
    for name, save in (
        ("x.npy", lambda path, one: np.save(path, one)),
        ("x.npz", lambda path, one: np.savez(path, points_mm=one)),
    ):
        save(tmp_path / name, np.array([Ran()], object))
        with pytest.raises(ValueError, match="numbers are needed"):
            Mesh.load(tmp_path / name)
    assert not Ran.ran


class Ran:
    """What says so where it is unpickled."""

    ran = False

    def __reduce__(self):
        return setattr, (Ran, "ran", True)


def test_folds_of_very_many_steps_are_refused(tmp_path):
    path = tmp_path / "x.json"
    steps = ", ".join(f'{{"step": {step}, "frames": 1, "cells": []}}' for step in range(20_000))
    path.write_text(f'{{"joint": "a", "step_rad": 0.01, "lines": [64, 64], "steps": [{steps}]}}')
    with Cost() as cost, pytest.raises(BodyError, match="20,000 steps of angles; the limit is 10,000"):
        Folds.load(path)
    assert cost.peak < 40e6


def test_the_page_on_security_states_these_limits():
    page = (Path(__file__).resolve().parents[2] / "SECURITY.md").read_text(encoding="utf-8")
    rows = {line.split("|")[1].strip(): line for line in page.splitlines() if line.startswith("| ")}
    for row, numbers in {
        "Any TOML": (tomlfile.MAX_BYTES // 10**6, tomlfile.MAX_DEPTH),
        "Skin files of several sheets": (MOST_SHEETS,),
        "Robot": (mcap.MAX_LINKS, mcap.MAX_NAME),
        "URDF": (urdf.MAX_BYTES // 10**6, xmlfile.MAX_ELEMENTS, urdf.MAX_LINKS),
        "Mesh of a robot": (mesh_file.MAX_BYTES // 10**6, mesh_file.MAX_TRIANGLES, *mesh_file.MAX_WORDS.values()),
        "Recording (MCAP)": (
            *(mcap.LARGEST >> 20, mcap.FREE >> 20, mcap.RATIO, mcap.LEAST >> 10),
            *(mcap.MAX_LINKS, mcap.MAX_NAME, mcap.MAX_TEXTS),
        ),
        "Frames": (array_file.MAX_BYTES >> 30,),
        "Table of a surface": (mesh.MAX_BYTES,),
        "Folds of a cover": (folds.MAX_BYTES // 10**6, folds.MAX_STEPS),
        "JSON of `contactfpga haptics`": (reading.MAX_BYTES // 10**6, reading.MAX_CONTACTS, reading.MAX_UNITS),
        "Names and values": (values.MAX_SHOWN, values.MAX_MESSAGE),
    }.items():
        (line,) = [line for name, line in rows.items() if name.startswith(row)]
        for number in numbers:
            assert f" {number:,}" in line, (row, number)
