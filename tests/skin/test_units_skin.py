"""Pressure units in the Skin: a converter of one's own, and the clocks that follow. Refusals: test_skin_refused."""

import pytest
import toy_converter

from contactfpga import Skin, SkinError


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
