"""Pressure units in the Skin: what is refused, and the clocks that follow."""

import pytest

from contactfpga import Skin, SkinError
from contactfpga.skin.derived import Derived

SUMS = "unit_sums holds "


@pytest.mark.parametrize(
    ("fields", "message"),
    [
        ({"units": 9}, "units is 9; MCP3208 has 8 channels"),
        ({"units": -1}, "units is -1"),
        ({"units": 2.5}, "units is 2.5; it must be a whole number"),
        ({"units": 2, "converter": "ads"}, "converter is 'ads'; it must be one of 'mcp3208'"),
        ({"units": 2, "converter_v": 2.5}, "converter_v is 2.5; MCP3208 needs 2.7 to 5.5 V"),
        ({"units": 2, "converter_v": 6}, "converter_v is 6.0; MCP3208 needs 2.7 to 5.5 V"),
        ({"converter_v": 5.0}, "converter_v is 5.0; leave it out, or set units"),
        ({"unit_sums": [[1]]}, SUMS),
        ({"units": 2, "unit_sums": 3}, "unit_sums is 3; it must be a list of at most 4 lists of weights"),
        ({"units": 1, "unit_sums": [[1]] * 5}, "it must be a list of at most 4 lists"),
        ({"units": 2, "unit_sums": [[1]]}, "it must hold a weight for each of 2 units, not all 0"),
        ({"units": 2, "unit_sums": [[0, 0]]}, "not all 0"),
        ({"units": 2, "unit_sums": [[1, 128]]}, "weights are whole numbers from -127 to 127"),
        ({"units": 2, "unit_sums": [[1, 0.5]]}, "weights are whole numbers from -127 to 127"),
    ],
)
def test_units_that_cannot_be_are_refused(fields, message):
    with pytest.raises(SkinError) as caught:
        Skin(**fields)
    assert message in str(caught.value)


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
    units = Derived(skin).units
    assert units.level_clocks == level
    assert units.sweep_clocks / clock_hz * 1e6 == pytest.approx(sweep_us)
