"""What makes a Skin's pressure units impossible."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from contactfpga.choices import converters
from contactfpga.errors import SkinError
from contactfpga.inputs.values import shown, whole
from contactfpga.skin import limits
from contactfpga.skin.units import MAX_SUMS, MAX_WEIGHT

if TYPE_CHECKING:
    from contactfpga.skin import Skin


def check_units(skin: Skin) -> dict[str, Any]:
    """Units, converter and sums go together; returns the sums as tuples."""
    converter = converters.find(skin.converter)
    if not 0 <= skin.units <= converter.channels:
        raise SkinError(f"units is {skin.units}; {converter.title} has {converter.channels} channels")
    sums = _sums(skin.unit_sums, skin.units)
    if not skin.units:
        if skin.converter_v != limits.CONVERTER_V:
            raise SkinError(f"converter_v is {skin.converter_v}; leave it out, or set units")
        return {"unit_sums": sums}
    least_v = converter.limits[0][0]
    if not least_v <= skin.converter_v <= converter.most_v:
        raise SkinError(f"converter_v is {skin.converter_v}; {converter.title} needs {least_v} to {converter.most_v} V")
    return {"unit_sums": sums}


def _sums(value: Any, units: int) -> tuple[tuple[int, ...], ...]:
    if not isinstance(value, list | tuple) or len(value) > MAX_SUMS:
        raise SkinError(f"unit_sums is {shown(value)}; it must be a list of at most {MAX_SUMS} lists of weights")
    return tuple(_weights(row, units) for row in value)


def _weights(row: Any, units: int) -> tuple[int, ...]:
    weights = [whole(weight) for weight in row] if isinstance(row, list | tuple) else []
    if len(weights) != units or not any(weights):
        raise SkinError(f"unit_sums holds {shown(row)}; it must hold a weight for each of {units} units, not all 0")
    found = tuple(weight for weight in weights if weight is not None and abs(weight) <= MAX_WEIGHT)
    if len(found) != units:
        raise SkinError(f"unit_sums holds {shown(row)}; weights are whole numbers from -{MAX_WEIGHT} to {MAX_WEIGHT}")
    return found
