"""What makes a Skin's surface impossible, and the pitch of a sheet whose ends meet."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from contactfpga.choices import labellers
from contactfpga.errors import SkinError
from contactfpga.inputs.values import shown
from contactfpga.skin import limits

if TYPE_CHECKING:
    from contactfpga.skin import Skin

_MIN_RADIUS_MM, _MAX_RADIUS_MM = 0.1, 100_000.0
_PITCH_TOLERANCE = 1e-3
"""By which share a pitch may miss the one that the radius gives."""


def check_surface(skin: Skin) -> dict[str, float]:
    """Surface, radius and pitch go together; returns the pitch of a closed sheet."""
    if skin.surface == "plane":
        if skin.closed:
            raise SkinError("surface is 'plane'; closed = true needs surface = 'cylinder' and radius_mm")
        if skin.radius_mm is not None:
            raise SkinError(f"radius_mm is {skin.radius_mm}; a plane has none, leave it out")
        return {}
    if skin.radius_mm is None:
        raise SkinError("radius_mm is missing; surface = 'cylinder' needs it")
    if not _MIN_RADIUS_MM <= skin.radius_mm <= _MAX_RADIUS_MM:
        raise SkinError(
            f"radius_mm is {shown(skin.radius_mm)}; it must lie between {_MIN_RADIUS_MM} and {_MAX_RADIUS_MM} mm"
        )
    around_mm = 2 * math.pi * skin.radius_mm
    return _check_closed(skin, around_mm) if skin.closed else _check_gap(skin, around_mm)


def _check_gap(skin: Skin, around_mm: float) -> dict[str, float]:
    """The ends do not meet."""
    if skin.columns * skin.pitch_x_mm >= around_mm:
        most = math.ceil(around_mm / skin.pitch_x_mm) - 1
        advice = f"use at most {most} columns" if most else "use a larger radius_mm or a smaller pitch_x_mm"
        raise SkinError(
            f"{skin.columns} columns of {skin.pitch_x_mm} mm take {skin.columns * skin.pitch_x_mm:g} mm of a "
            f"circumference of {around_mm:g} mm: the sheet's ends meet; set closed = true, or {advice}"
        )
    return {}


def _check_closed(skin: Skin, around_mm: float) -> dict[str, float]:
    if skin.columns < limits.MIN_AROUND:
        raise SkinError(f"columns is {skin.columns}; closed = true needs at least {limits.MIN_AROUND}")
    if skin.ghosts:
        raise SkinError("diodes is 'none'; closed = true needs 'col2row' or 'row2col'")
    if skin.report == "barycenter":
        raise SkinError("report is 'barycenter'; closed = true needs report = 'moments' or 'cells'")
    if skin.report == "moments" and not labellers.find(skin.labeller).closed:
        able = " or ".join(repr(name) for name, labeller in labellers.LABELLERS.items() if labeller.closed)
        raise SkinError(f"labeller is {str(skin.labeller)!r}; closed = true needs labeller = {able}")
    pitch_mm = around_mm / skin.columns
    given = skin.pitch_x_mm != type(skin).pitch_x_mm
    if given and abs(skin.pitch_x_mm / pitch_mm - 1) > _PITCH_TOLERANCE:
        raise SkinError(
            f"pitch_x_mm is {skin.pitch_x_mm}; {skin.columns} columns around a radius of {skin.radius_mm:g} mm have "
            f"{pitch_mm:g} mm, leave it out"
        )
    if not limits.MIN_PITCH_MM <= pitch_mm <= limits.MAX_PITCH_MM:
        raise SkinError(
            f"{skin.columns} columns around a radius of {skin.radius_mm:g} mm have a pitch of {pitch_mm:g} mm; it must "
            f"lie between {limits.MIN_PITCH_MM} and {limits.MAX_PITCH_MM} mm"
        )
    return {"pitch_x_mm": pitch_mm}
