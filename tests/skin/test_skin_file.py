"""A Skin as a file, and its fingerprint."""

import dataclasses
import inspect
import json
import re
import tomllib
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from contactfpga import Skin, SkinError, examples
from contactfpga.design.cover import Bed, Cap, Cover, CoverError, Switch, foams, load_cover
from contactfpga.design.cover.press import read_cover, write_cover

CLOSED = {"surface": "cylinder", "radius_mm": 25, "closed": True}
REVERSAL = {"scan": "reversal", "precharge_us": 0.25}


# ---- file and fingerprint


REPORTS = st.sampled_from([{"report": "moments"}, {"report": "cells"}]) | st.builds(
    lambda bits: {"report": "barycenter", "barycenter_bits": bits}, st.integers(0, 8)
)


@st.composite
def skins(draw):
    rows, columns = draw(st.integers(1, 64)), draw(st.integers(1, 64))
    radius_mm = draw(st.none() | st.floats(200.0, 90_000.0))
    cell = st.tuples(st.integers(0, rows - 1), st.integers(0, columns - 1))
    mask = draw(st.lists(cell, max_size=min(5, rows * columns - 1)))
    return Skin(
        rows=rows,
        columns=columns,
        pitch_x_mm=draw(st.floats(0.01, 15.0)),
        pitch_y_mm=draw(st.floats(0.01, 1000.0)),
        surface="plane" if radius_mm is None else "cylinder",
        radius_mm=radius_mm,
        mask=tuple(mask),
        connectivity=draw(st.sampled_from([4, 8])),
        diodes=draw(st.sampled_from(["col2row", "row2col"])),
        settle_us=draw(st.floats(600.0, 10_000.0)),
        release_us=draw(st.floats(1.0, 10_000.0)),
        debounce=draw(st.sampled_from(["none", "sym_defer_pk", "asym_eager_defer_pk"])),
        debounce_press_us=draw(st.floats(0.0, 5000.0)),
        **draw(REPORTS),
        zone_capacity=draw(st.none() | st.just(1)),
    )


@given(skin=skins())
@settings(max_examples=200, deadline=None)
def test_a_file_gives_the_same_skin_back(tmp_path_factory, skin):
    path = tmp_path_factory.mktemp("skin") / "skin.toml"
    path.write_text(skin.to_toml(), encoding="utf-8")
    loaded = Skin.load(path)
    assert loaded == skin
    assert loaded.fingerprint == skin.fingerprint


@given(first=skins(), second=skins())
@settings(max_examples=100, deadline=None)
def test_fingerprints_tell_skins_apart(first, second):
    assert (first == second) == (first.fingerprint == second.fingerprint)
    assert len(first.fingerprint) == 8


OTHER = {
    "row_drive": "74hc595",
    "column_read": "74hc165",
    "rows": 15,
    "columns": 15,
    "pitch_x_mm": 9.0,
    "pitch_y_mm": 9.0,
    "mask": ((1, 1),),
    "connectivity": 4,
    "diodes": "row2col",
    "settle_us": 6.0,
    "release_us": 2.0,
    "precharge_us": 0.25,
    "debounce": "sym_defer_pk",
    "debounce_press_us": 4000.0,
    "debounce_release_us": 4000.0,
    "labeller": "serial",
    "report": "cells",
    "extent": True,
    "send": "on_change",
    "keep_alive_ms": 50.0,
    "zone_capacity": 63,
    "clock_hz": 24_000_000,
    "baud": 1_000_000,
    "guard": True,
    "row_order": (1, 0, *range(2, 16)),
    "column_order": (1, 0, *range(2, 16)),
    "fail_safe": True,
    "alive": True,
    "dual": True,
}


def test_every_field_is_in_the_fingerprint():
    others = [Skin(**{name: value}) for name, value in OTHER.items()]
    others += [Skin(surface="cylinder", radius_mm=radius_mm) for radius_mm in (100.0, 101.0)]
    others.append(Skin(**CLOSED))
    registers = Skin(row_drive="74hc595", column_read="74hc165")
    only_there = {"row_chains": 2, "column_chains": 2, "shift_hz": 4_000_000}
    others += [registers, *(registers.replace(**{name: value}) for name, value in only_there.items())]
    divided = Skin(report="barycenter")
    others += [divided, divided.replace(barycenter_bits=3)]
    reversal = Skin(**REVERSAL)
    others += [
        reversal,
        reversal.replace(project_us=2.0),
        reversal.replace(precharge_us=0.5),
        reversal.replace(self_test=True),
    ]
    falls = Skin(guard=True, precharge_us=1.0)
    map_ = falls.replace(report="cells", ruler=16)
    others += [falls, falls.replace(ruler=16), map_, map_.replace(harder=(4,))]
    measured = Skin(units=2)
    of_units = {"converter": "toy_converter:MINE", "converter_v": 5.0, "unit_sums": ((1, 1),)}
    others += [measured, *(measured.replace(**{name: value}) for name, value in of_units.items())]
    elsewhere = {
        "units",
        "name",
        "closed",
        "surface",
        "radius_mm",
        "scan",
        "project_us",
        "barycenter_bits",
        "self_test",
        "ruler",
        "harder",
    }
    assert {*OTHER, *elsewhere, *only_there, *of_units} == {field.name for field in dataclasses.fields(Skin)}
    assert len({skin.fingerprint for skin in [Skin(), *others]}) == len(others) + 1


def test_fingerprints_of_boards_that_are_in_use_stay_the_same():
    assert Skin().fingerprint.hex() == "44136fa355b3678a"
    assert Skin(rows=13, columns=6, report="cells", send="on_change").fingerprint.hex() == "d3e1f271ecb47488"


@pytest.mark.parametrize("name", ["fast", "fast-64x64"])
def test_examples_of_line_reversal(name, tmp_path):
    """They load, differ in the sheet alone, and a file that is written of one is read as the same Skin."""
    skin = Skin.load(examples() / f"{name}.toml")
    assert (skin.scan, skin.precharge_us, skin.settle_us, skin.project_us) == ("reversal", 0.25, 0.5, 1.0)
    assert (skin.clock_hz, skin.baud, skin.send) == (24_000_000, 12_000_000, "on_change")
    size = 64 if "64" in name else 16
    assert skin == Skin.load(examples() / "fast.toml").replace(rows=size, columns=size, zone_capacity=None)
    path = tmp_path / "again.toml"
    path.write_text(skin.to_toml())
    assert Skin.load(path) == skin
    assert Skin.load(path).fingerprint == skin.fingerprint != Skin().fingerprint


def test_a_name_and_what_is_written_as_it_is_by_default_change_no_fingerprint():
    assert Skin(name="left forearm", zone_capacity=64, baud=3_000_000).fingerprint == Skin().fingerprint
    assert Skin(rows=8, zone_capacity=32).fingerprint == Skin(rows=8).fingerprint


def test_fingerprint_is_the_same_in_another_process_and_however_it_was_written(python):
    code = "from contactfpga import Skin; print(Skin(pitch_x_mm=10, mask=[[2, 1], [0, 3], [2, 1]]).fingerprint.hex())"
    assert python(code).stdout.strip() == Skin(pitch_x_mm=10.0, mask=((0, 3), (2, 1))).fingerprint.hex()


def test_file_with_an_unknown_key(tmp_path):
    path = tmp_path / "skin.toml"
    path.write_text("rows = 8\ncolumn = 8\n")
    with pytest.raises(SkinError, match=r"skin.toml: unknown key 'column'; did you mean 'columns'\?$"):
        Skin.load(path)
    path.write_text("xyz = 8\n")
    with pytest.raises(SkinError, match=r"unknown key 'xyz'; known are name, rows, .*, \[cover\], \[circuit\]$"):
        Skin.load(path)
    path.write_text("x" * 100_000 + " = 8\n")
    with pytest.raises(SkinError, match="100002 characters"):
        Skin.load(path)


@pytest.mark.parametrize("build", [Skin, Skin().replace])
def test_a_field_that_does_not_exist(build):
    with pytest.raises(TypeError, match=r"^a Skin has no field 'row'; did you mean 'rows'\?$"):
        build(row=8)
    with pytest.raises(TypeError, match=r"^a Skin has no field 'xyz'; known are name, rows, columns, "):
        build(xyz=8)
    assert "rows" in inspect.signature(Skin).parameters


def test_file_that_is_no_toml(tmp_path):
    path = tmp_path / "skin.toml"
    path.write_text("rows: 8\n")
    with pytest.raises(SkinError, match=r"skin\.toml: not a TOML file"):
        Skin.load(path)


def test_empty_file_is_the_reference_skin(tmp_path):
    path = tmp_path / "skin.toml"
    path.write_text("")
    assert Skin.load(path) == Skin()


COVERED = """rows = 8
[cover]
model = "foam"
thickness_m = 0.004
[cover.switch]
force_n = 0.5
"""


def test_a_file_with_a_cover(tmp_path):
    path = tmp_path / "skin.toml"
    path.write_text(COVERED)
    assert Skin.load(path) == Skin(rows=8)
    assert load_cover(path) == Cover("foam", 0.004, Switch(0.5))
    path.write_text(Skin(rows=8).to_toml() + write_cover(Cover(share=0.25)))
    assert (Skin.load(path), load_cover(path)) == (Skin(rows=8), Cover(share=0.25))
    path.write_text("rows = 8")
    assert load_cover(path) is None


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ('"foam"', '"sand"', "model is 'sand'; it must be one of patch, foam, point"),
        ('"foam"', '"bonded"', "model is 'bonded', which no longer exists; take 'foam'"),
        ("thickness_m", "thickness", "unknown key 'thickness' in [cover]; did you mean 'thickness_m'?"),
        ("force_n = 0.5", "force = 1", "unknown key 'force' in [cover.switch]; did you mean 'force_n'?"),
        ("force_n = 0.5", "force_n = -1", "force_n is -1; it must be a finite number above 0 N"),
        ("[cover.switch]\nforce_n = 0.5", "switch = 4", "cover.switch is 4; it must be a part, [cover.switch]"),
        (COVERED, "cover = 3\n", "cover is 3; it must be a part, [cover]"),
    ],
)
def test_a_cover_that_cannot_be_is_refused(tmp_path, old, new, message):
    assert old in COVERED
    path = tmp_path / "skin.toml"
    path.write_text(COVERED.replace(old, new))
    with pytest.raises(CoverError) as caught:
        load_cover(path)
    assert "skin.toml: " in str(caught.value)
    assert message in str(caught.value)


def test_fields_are_plain_values():
    """Whatever reads a Skin's fields, as the golden model does, needs no code of the host."""
    fields = dataclasses.asdict(Skin(mask=[[1, 2]]))
    assert json.loads(json.dumps(fields)) == fields | {
        "mask": [[1, 2]],
        "harder": [],
        "row_order": [],
        "column_order": [],
        "unit_sums": [],
    }


def test_a_value_that_cannot_be_is_named_with_its_file(tmp_path):
    path = tmp_path / "skin.toml"
    path.write_text("rows = 0\n")
    with pytest.raises(SkinError) as caught:
        Skin.load(path)
    assert str(caught.value) == f"{path}: rows is 0; it must lie between 1 and 64"


@pytest.mark.parametrize(
    ("table", "kind"), [("cover", Cover), ("cover.cap", Cap), ("cover.switch", Switch), ("cover.bed", Bed)]
)
def test_the_page_lists_each_key_of_the_cover_with_its_default(table, kind):
    page = (Path(__file__).resolve().parents[2] / "docs/skin.md").read_text(encoding="utf-8")
    (rows,) = re.findall(rf"^\| `\[{re.escape(table)}\]` .*\n\|[-|]+\|\n((?:\|.*\n)+)", page, re.MULTILINE)
    defaults = dict(re.findall(r"^\| `(\w+)` \| ?([^|]*?) ?\|", rows, re.MULTILINE))
    if table == "cover":  # a foam is a name for a modulus
        name = tomllib.loads(f"x = {defaults.pop('foam').strip('`')}")["x"]
        defaults["modulus_pa"] = str(foams.find(name).layer_pa)
    fields = {
        field.name: field.default
        for field in dataclasses.fields(kind)
        if field.name not in ("switch", "cap", "cell", "bed")
    }
    assert defaults.keys() == fields.keys()
    for name, default in fields.items():
        if default is None:
            assert defaults[name] == "none"
        elif default is dataclasses.MISSING:
            assert defaults[name] == ""
        else:
            assert tomllib.loads(f"x = {defaults[name].strip('`')}")["x"] == default


def test_the_example_of_tiles_is_the_cover_of_the_page():
    page = (Path(__file__).resolve().parents[2] / "docs/skin.md").read_text(encoding="utf-8")
    (text,) = re.findall(r"```toml\n(\[cover\]\n.*?)```", page, re.DOTALL)
    assert read_cover(tomllib.loads(text)["cover"]) == load_cover(examples() / "tiles.toml")
    skin = Skin.load(examples() / "tiles.toml")
    assert (skin.rows, skin.columns, skin.pitch_x_mm, skin.pitch_y_mm, skin.connectivity) == (16, 16, 6.4, 6.4, 4)
    assert skin == Skin(pitch_x_mm=6.4, pitch_y_mm=6.4, connectivity=4)


def test_a_file_may_begin_with_a_byte_order_mark_as_some_editors_write_it(tmp_path):
    path = tmp_path / "skin.toml"
    path.write_text("rows = 9\n", encoding="utf-8-sig")
    assert Skin.load(path).rows == 9
