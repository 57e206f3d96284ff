"""The Skin: what it refuses and with which words, its file, its fingerprint, and what it fills in."""

import dataclasses
import math
from typing import get_args

import numpy as np
import pytest
import toy_converter
from hypothesis import given, settings
from hypothesis import strategies as st
from refused_skins import CLOSED, REFUSED, REVERSAL

from contactfpga import ContactFPGAError, Skin, SkinError
from contactfpga.choices import converters, debounces, labellers, reports, scans

LONG = {"settle_us": 1000.0}  # no row too short for what the rest asks of it


def test_whole_numbers_of_numpy_make_the_same_skin():
    plain = Skin(rows=8, columns=8, connectivity=4, mask=[(1, 2)])
    mask = np.argwhere(np.arange(64).reshape(8, 8) == 10)
    skin = Skin(rows=np.int64(8), columns=np.uint8(8), connectivity=np.int32(4), mask=list(map(tuple, mask)))
    assert skin == plain
    assert skin.fingerprint == plain.fingerprint
    assert type(skin.rows) is type(skin.connectivity) is type(skin.mask[0][0]) is int


JUST_WITHIN = [
    {"row_drive": "74hc595", "column_read": "74hc165", "shift_hz": 10_000},
    {"row_drive": "74hc595", "row_chains": 16, "column_read": "74hc165", "column_chains": 16, "shift_hz": 50_000_000},
    {"rows": 1, "columns": 2, "mask": [[0, 0]]},
    {"mask": [[15, 15], (0, 0)]},
    {"surface": "cylinder", "radius_mm": 25, "columns": 15},
    {"clock_hz": 1_000_000, "baud": 500_000, "settle_us": 100},
    {"send": "on_change", "keep_alive_ms": 0.096},
    {"send": "always", "keep_alive_ms": 500},
    {"report": "barycenter", "rows": 32, "columns": 32, "zone_capacity": 199},
    {**REVERSAL, "settle_us": 0.08, "release_us": 0.08, "project_us": 0.08, "rows": 64, "columns": 64},
    {**REVERSAL, "send": "on_change", "keep_alive_ms": 3.072},
    {**REVERSAL, "send": "on_change", "keep_alive_ms": 15.36, "rows": 64, "settle_us": 100},
    {"settle_us": 0.8},
    {"debounce": "sym_defer_pk", "debounce_press_us": 393_120, "debounce_release_us": 0},
    {"debounce": "none", "debounce_press_us": -1},
]


@pytest.mark.parametrize("changes", JUST_WITHIN, ids=str)
def test_what_just_keeps_the_limits_is_taken(changes):
    skin = Skin(**changes)
    assert all(getattr(skin, name) == value for name, value in changes.items() if name != "mask")


def test_limits_are_reported_by_field():
    assert Skin.limits("rows") == Skin(rows=8).limits("columns") == (1, 64, "")
    assert Skin.limits("baud") == (1200, 200_000_000, "bits per second")
    with pytest.raises(KeyError):
        Skin.limits("name")


@pytest.mark.parametrize("radius_mm", [3.3, 10.0, 12.5, 25.4, 100.0])
def test_a_cylinder_takes_as_many_columns_as_the_message_says(radius_mm):
    fields = {"surface": "cylinder", "radius_mm": radius_mm, **LONG}
    with pytest.raises(SkinError, match="ends meet") as caught:
        Skin(columns=64, **fields)
    most = int(str(caught.value).split()[-2])
    Skin(columns=most, **fields)
    with pytest.raises(SkinError, match="ends meet"):
        Skin(columns=most + 1, **fields)


def test_the_pitch_of_a_closed_sheet_follows_from_its_radius():
    skin = Skin(**CLOSED)
    assert skin.pitch_x_mm == 2 * math.pi * 25 / 16
    assert skin == Skin(**CLOSED, pitch_x_mm=9.8175), "a pitch that is rounded is made exact"
    assert skin.replace(columns=8).pitch_x_mm == 2 * math.pi * 25 / 8
    assert skin.replace(radius_mm=50.0).pitch_x_mm == 2 * math.pi * 50 / 16
    assert skin.fingerprint != Skin(surface="cylinder", radius_mm=25, pitch_x_mm=9.8).fingerprint


@pytest.mark.parametrize(("connectivity", "zones"), [(8, 3 * 3), (4, 5 * 3)])
def test_the_most_zones_around_a_cylinder(connectivity, zones):
    """Of 5x7: a row holds no more runs than half its columns."""
    assert Skin(**CLOSED, rows=5, columns=7, connectivity=connectivity).max_zones() == zones


def test_a_closed_sheet_is_read_from_the_file_that_is_written_of_it(tmp_path):
    skin = Skin(**CLOSED, columns=7)
    (tmp_path / "skin.toml").write_text(skin.to_toml())
    assert Skin.load(tmp_path / "skin.toml") == skin


@pytest.mark.parametrize(("baud", "good"), [(2_960_000, True), (2_950_000, False)])
def test_the_limit_of_the_baud_error(baud, good):
    """12 MHz / 4 is 3 Mbaud: 1.35 % above the one, 1.69 % above the other."""
    if good:
        Skin(baud=baud)
    else:
        with pytest.raises(SkinError, match=r"\+1.69 %.*nearest good rates: 2400000, 3000000, 4000000"):
            Skin(baud=baud)


@given(st.integers(1, 200), st.integers(1200, 3_000_000))
@settings(max_examples=300, deadline=None)
def test_named_rates_are_good_ones(megahertz, baud):
    clock_hz = megahertz * 1_000_000
    if baud > clock_hz // 2:
        return
    refused = ""
    try:
        Skin(clock_hz=clock_hz, baud=baud, **LONG)
    except SkinError as error:
        refused = str(error)
    if refused:
        rates = refused.partition("nearest good rates: ")[2].split(", ")
        assert [Skin(clock_hz=clock_hz, baud=int(rate), **LONG) for rate in rates]


def test_every_field_has_a_default_and_a_refusal():
    """A field that nothing can be wrong with would be one that nobody checks."""
    touched = {name for changes, _ in REFUSED for name in changes}
    assert touched == {field.name for field in dataclasses.fields(Skin)}
    Skin()


def test_the_names_of_choices_are_those_that_types_know():
    for names, known in (
        (labellers.LabellerName, labellers.LABELLERS),
        (scans.ScanName, scans.SCANS),
        (debounces.DebounceName, debounces.DEBOUNCES),
        (converters.ConverterName, converters.CONVERTERS),
        (reports.ReportName, reports.REPORTS),
    ):
        assert get_args(names) == tuple(known)


def test_the_reference_skin():
    skin = Skin()
    assert (skin.rows, skin.columns, skin.connectivity, skin.report) == (16, 16, 8, "moments")
    assert (skin.clock_hz, skin.baud, skin.settle_us, skin.release_us) == (12_000_000, 3_000_000, 5.0, 1.0)
    assert (skin.debounce, skin.send, skin.scan) == ("none", "always", "raster")
    assert skin.derived.frame_clocks == 16 * 72


def test_a_skin_does_not_change():
    with pytest.raises(dataclasses.FrozenInstanceError):
        Skin().rows = 8


# ---- what is refused


@pytest.mark.parametrize(("changes", "message"), REFUSED, ids=[str(changes) for changes, _ in REFUSED])
def test_refused_with_value_and_limit(changes, message):
    with pytest.raises(SkinError) as caught:
        Skin(**changes)
    assert str(caught.value) == message
    assert isinstance(caught.value, ValueError)
    assert isinstance(caught.value, ContactFPGAError)


@pytest.mark.parametrize("field", ["rows", "connectivity", "pitch_x_mm", "clock_hz", "baud", "shift_hz"])
@pytest.mark.parametrize("digits", [400, 5000])
def test_numbers_that_no_float_holds_are_refused_in_a_short_sentence(field, digits):
    with pytest.raises(SkinError, match=f"^{field} is ") as caught:
        Skin(**{field: 10**digits})
    assert len(str(caught.value)) < 200


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


# ---- units


def test_a_converter_of_ones_own_is_found_and_has_its_own_channels():
    skin = Skin(units=4, converter="toy_converter:MINE")
    assert skin.fingerprint != Skin(units=4).fingerprint
    assert Skin(units=4, converter=toy_converter.MINE) == skin
    with pytest.raises(SkinError, match="units is 5; MCP3204 has 4 channels"):
        skin.replace(units=5)


def test_a_file_keeps_units(tmp_path):
    skin = Skin(units=3, unit_sums=((1, -1, 0), (1, 1, 1)), converter_v=5.0)
    file = tmp_path / "skin.toml"
    file.write_text(skin.to_toml())
    assert Skin.load(file) == skin
    assert Skin.load(file).fingerprint == skin.fingerprint != Skin(units=3).fingerprint


@pytest.mark.parametrize(
    ("clock_hz", "supply_v", "level", "sweep_us"),
    [(12_000_000, 3.3, 6, 160), (12_000_000, 5.0, 3, 80), (25_000_000, 4.9, 13, 166.4), (1_000_000, 5.0, 1, 320)],
)
def test_eight_units_take_80_us_at_5_v_and_160_us_below(clock_hz, supply_v, level, sweep_us):
    """A level is a whole number of clocks."""
    skin = Skin(clock_hz=clock_hz, baud=clock_hz // 10, units=8, converter_v=supply_v, settle_us=50.0)
    units = skin.derived.units
    assert units.level_clocks == level
    assert units.sweep_clocks / clock_hz * 1e6 == pytest.approx(sweep_us)
