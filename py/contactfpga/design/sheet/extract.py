"""The circuit of a layout's lines: resistance from their copper, capacitance from neighbors and crossings.

Formulas are for copper of no thickness on or in one dielectric, good to some ten percent:

- a track that crosses another at right angles: eps w1' w2' / h, with w' the width of the plate that has a track's
  capacitance per length over a plane (Hammerstad and Jensen, Accurate models for microstrip computer-aided design,
  IEEE MTT-S 1980, pp. 407-409);
- two adjacent tracks: 2 eps0 e K(k')/K(k), k^2 = s (s + w1 + w2) / ((s + w1)(s + w2)), with K the complete elliptic
  integral and e the mean of board and air (Wadell, Transmission Line Design Handbook, 1991, section 3.4);
- resistance: that of copper; a line's branches are solved as a network.

The circuit model adds diode charge. An open switch has its contacts' capacitance in series with its diode's.
"""

from __future__ import annotations

import dataclasses
import math

import numpy as np

from contactfpga.design.circuit import Circuit
from contactfpga.design.sheet.drawing import BOARDS, TRACK_MM, Drawing
from contactfpga.design.sheet.layout import Layout
from contactfpga.design.sheet.parts import SwitchPart
from contactfpga.skin import Skin

EPS0_PF_MM = 8.8541878e-3
SHEET_OHM = 4.9e-4
"""Sheet resistance of 35 um copper at 20 degrees Celsius."""
VIA_SIEMENS = 1e3
PIN_PF = 10.0
"""Capacitance of a pin of an FPGA, a 74HC595 or a 74HC165 with its pads."""
CABLE_PF_M = 50.0
"""Capacitance of a meter of ribbon cable (docs/maker.md)."""


@dataclasses.dataclass(frozen=True)
class LineValues:
    """Values of a layout's lines; capacitances in pF."""

    circuit: Circuit
    """The layout's circuit; one value holds for all lines."""
    row_ohm: tuple[float, float]
    """Lowest and highest resistance of the rows, from resistor to far end."""
    column_ohm: tuple[float, float]
    crossing_pf: tuple[float, float]
    """Lowest and highest capacitance of a row to a column; the circuit has the mean."""
    row_neighbor_pf: float
    """Capacitance of a row to the next; the circuit has the larger of rows' and columns'."""
    column_neighbor_pf: float


def extracted(layout: Layout, cable_m: float = 0.3) -> LineValues:
    """The circuit of a layout with ``cable_m`` of ribbon cable at its connectors."""
    skin, switch = layout.skin, layout.switch
    _, h, eps = BOARDS[skin.surface]
    e = (eps + 1) / 2
    rows, columns = _line_ohms(layout, "row"), _line_ohms(layout, "column")
    crossing = _crossings(layout, h, eps, e)
    along = beside_pf(TRACK_MM, TRACK_MM, skin.pitch_y_mm - TRACK_MM, e) * skin.columns * skin.pitch_x_mm
    down = skin.rows * _past_pf(skin, switch, None, e)
    row_neighbor = along if skin.rows > 1 else 0.0
    column_neighbor = down if skin.columns > 1 else 0.0
    fanned = [_fanned_mm(layout.drawing, line.pin) for line in layout.lines]
    strip = 2 * beside_pf(TRACK_MM, TRACK_MM, 2 * TRACK_MM, e) * max(fanned)
    circuit = layout.circuit.replace(
        line_pf=_said(PIN_PF + CABLE_PF_M * cable_m + strip),
        crossing_pf=_said(float(crossing.mean())),
        neighbor_pf=_said(max(row_neighbor, column_neighbor)),
        line_ohm=_said(max(rows + columns, default=0.0)),
    )
    return LineValues(
        circuit,
        (min(rows, default=0.0), max(rows, default=0.0)),
        (min(columns, default=0.0), max(columns, default=0.0)),
        (float(crossing.min()), float(crossing.max())),
        row_neighbor,
        column_neighbor,
    )


def _said(value: float) -> float:
    return float(f"{value:.3g}")


def over_pf(width: float, height: float, eps: float) -> float:
    """Capacitance per length in pF/mm of a track over a plane (Hammerstad and Jensen); 0.01 <= w/h <= 100."""
    u = width / height
    a = 1 + math.log((u**4 + (u / 52) ** 2) / (u**4 + 0.432)) / 49 + math.log(1 + (u / 18.1) ** 3) / 18.7
    b = 0.564 * ((eps - 0.9) / (eps + 3)) ** 0.053
    effective = (eps + 1) / 2 + (eps - 1) / 2 * (1 + 10 / u) ** (-a * b)
    f = 6 + (2 * math.pi - 6) * math.exp(-((30.666 / u) ** 0.7528))
    return float(2 * math.pi * EPS0_PF_MM * effective / math.log(f / u + math.sqrt(1 + (2 / u) ** 2)))


def across_pf(width: float, other: float, height: float, eps: float) -> float:
    plates = [over_pf(one, height, eps) * height / (EPS0_PF_MM * eps) for one in (width, other)]
    return EPS0_PF_MM * eps * plates[0] * plates[1] / height


def beside_pf(width: float, other: float, gap: float, eps: float) -> float:
    """Capacitance per length in pF/mm of two adjacent tracks."""
    k = math.sqrt(gap * (gap + width + other) / ((gap + width) * (gap + other)))
    return 2 * EPS0_PF_MM * eps * _mean(1.0, math.sqrt(1 - k * k)) / _mean(1.0, k)


def _mean(a: float, b: float) -> float:
    """The arithmetic-geometric mean M; K(k) is pi / (2 M(1, k'))."""
    while abs(a - b) > 1e-12 * a:
        a, b = (a + b) / 2, math.sqrt(a * b)
    return a


def _crossings(layout: Layout, h: float, eps: float, e: float) -> np.ndarray:
    """(rows, columns) in pF: crossings, the open switch, and the row's descent between two columns."""
    skin, switch = layout.skin, layout.switch
    wide = 2 * switch.half_width
    once = across_pf(TRACK_MM, wide, h, eps)
    junction = layout.circuit.diode.junction_pf
    opened = 0.0 if skin.diodes == "none" else switch.open_pf * junction / (switch.open_pf + junction)
    found = np.full((skin.rows, skin.columns), once + (opened or switch.open_pf))
    passed = _past_pf(skin, switch, TRACK_MM, e) if skin.columns > 1 else 0.0
    places = {line.net: line.x for line in layout.lines}
    for row in range(skin.rows):
        column = places[f"ROW{row}"] / skin.pitch_x_mm
        found[row, : max(0, math.ceil(column))] += once
        for beside in (math.floor(column), math.ceil(column)):
            if column > 0 and beside < skin.columns:
                found[row, beside] += passed * row
    return found


def _past_pf(skin: Skin, switch: SwitchPart, track: float | None, eps: float) -> float:
    """Capacitance in pF per cell height of a column to ``track`` midway between columns, or to the next column."""
    found, wide = 0.0, 2 * switch.half_width
    for width, length in ((wide, min(wide, skin.pitch_y_mm)), (TRACK_MM, max(0.0, skin.pitch_y_mm - wide))):
        gap = skin.pitch_x_mm - width if track is None else (skin.pitch_x_mm - width - track) / 2
        found += length * beside_pf(width, width if track is None else track, gap, eps)
    return found


def _fanned_mm(drawing: Drawing, net: str) -> float:
    return sum(track.length for track in drawing.tracks if track.net == net)


def _line_ohms(layout: Layout, kind: str) -> list[float]:
    return [_ohms(layout.drawing, line.net, line.x) for line in layout.lines if line.kind == kind and line.used]


def _ohms(drawing: Drawing, net: str, x: float) -> float:
    tracks = [track for track in drawing.tracks if track.net == net]
    spots: dict[tuple[float, float, str], int] = {}
    joints: list[tuple[int, int, float]] = []
    for track in tracks:
        ends = [(track.x1, track.y1, track.layer), (track.x2, track.y2, track.layer)]
        numbers = [spots.setdefault(end, len(spots)) for end in ends]
        joints.append((numbers[0], numbers[1], track.width / (SHEET_OHM * track.length)))
    for via in (via for via in drawing.vias if via.net == net):
        both = [spots[end] for layer in "FB" if (end := (via.x, via.y, layer)) in spots]
        if len(both) == 2:
            joints.append((both[0], both[1], VIA_SIEMENS))
    siemens = np.zeros((len(spots), len(spots)))
    for a, b, value in joints:
        siemens[a, a] += value
        siemens[b, b] += value
        siemens[a, b] -= value
        siemens[b, a] -= value
    top = min((y, number) for (at, y, layer), number in spots.items() if layer == "F" and abs(at - x) < 1e-5)[1]
    others = [number for number in range(len(spots)) if number != top]
    return float(np.linalg.inv(siemens[np.ix_(others, others)]).diagonal().max())
