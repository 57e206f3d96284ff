"""The parts of a sheet and their copper: pads, body, and article with its maker's number.

A part is seen on its own side of the board, in mm, x to the right and y down.
"""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Iterable

from contactfpga.errors import ContactFPGAError
from contactfpga.inputs.values import shown

MASK_MM = 0.05
"""Growth of a solder mask opening over its pad on each side."""
_E24 = (10, 11, 12, 13, 15, 16, 18, 20, 22, 24, 27, 30, 33, 36, 39, 43, 47, 51, 56, 62, 68, 75, 82, 91)


class SheetError(ContactFPGAError, ValueError):
    """A sheet that cannot be made."""


@dataclasses.dataclass(frozen=True)
class Pad:
    """A pad of a part; ``width`` is the diameter of a ``round`` pad, ``drill`` the diameter of a plated hole or 0."""

    number: str
    x: float
    y: float
    width: float
    height: float
    round: bool = False
    drill: float = 0.0


@dataclasses.dataclass(frozen=True)
class Part:
    """A part on the sheet."""

    name: str
    """Footprint, such as ``R_0603``."""
    order: str
    """Description for an order; an article's maker and number are in :attr:`article`."""
    pads: tuple[Pad, ...]
    width: float
    """Width of the area without other parts."""
    height: float
    pasted: bool = True
    """Whether the pads get solder paste; not for holes and a dome's contacts."""
    marks: tuple[tuple[float, float, float, float], ...] = ()
    """Printed lines (x, y, x, y) that mark the first pin or a cathode."""
    article: tuple[str, str] = ("", "")
    """Maker and number; ``{}`` in the number stands for a resistance. Empty: see :attr:`order`."""
    soldered: bool = True
    """Whether an assembler places it; a dome is laid by hand, a fiducial is only copper."""
    mask_mm: float = MASK_MM
    """Growth of the solder mask's openings over the pads on each side."""
    library_turn: int = 0
    """Degrees counterclockwise by which the part is drawn turned from the orientation that IPC-7351 and KiCad's library
    call 0, pin 1 at the upper left."""

    def number(self, value: str) -> str:
        """The maker's number for a value; "" if the maker lists none, as for a resistance outside the E24 series."""
        number = self.article[1]
        return number if "{}" not in number else number.format(code) if (code := _code(float(value))) else ""


@dataclasses.dataclass(frozen=True)
class SwitchPart:
    """A switch of the matrix, with the top-side copper between its pads.

    The column enters at (0, -reach) and leaves at (0, reach); it has pads 1. Pads 2 belong to the diode.
    """

    part: Part
    force_n: float
    travel_mm: float
    height_mm: float
    closed_by: float
    """Side or diameter of the plunger."""
    column: tuple[tuple[float, float, float, float], ...]
    """Tracks (x, y, x, y) from one end of the column to the other."""
    diode: tuple[tuple[float, float, float, float], ...]
    """Tracks from pads numbered 2 to the via of the diode."""
    via: tuple[float, float]
    """Position in a cell of the via to the diode on the back, outside all pads."""
    tail: int
    """Number of final column tracks that only lead to the next cell."""
    reach: float
    half_width: float
    """Extent of the cell's copper to either side of its middle."""
    open_pf: float


_LEG = 1.66
"""A dome of 5 mm span has its legs on a circle of 2.35 mm radius."""
_DOME_VIA = -0.88, -0.88
"""Beside the middle contact, so that solder mask covers the hole; a via diameter and a clearance from the leg."""
_SIDES = [(-_LEG, -_LEG), (0.0, -_LEG), (_LEG, -_LEG), (_LEG, _LEG), (0.0, _LEG), (-_LEG, _LEG), (-_LEG, -_LEG)]

DOME = SwitchPart(
    Part(
        "DOME_5MM_4LEG",
        "metal dome, round, 5 mm, four legs, 0.4 N +-10 %, 0.2 mm travel; no number is known: ask a maker of domes for "
        "these values and compare its pads with the drawing",
        (
            *(Pad("1", x * _LEG, y * _LEG, 1.2, 1.2, round=True) for x in (-1, 1) for y in (-1, 1)),
            Pad("2", 0.0, 0.0, 1.8, 1.8, round=True),
        ),
        5.0,
        5.0,
        pasted=False,
        soldered=False,
    ),
    force_n=0.4,
    travel_mm=0.2,
    height_mm=0.3,
    closed_by=1.5,
    column=tuple((*a, *b) for a, b in itertools.pairwise(_SIDES)),
    diode=((0.0, 0.0, *_DOME_VIA),),
    via=_DOME_VIA,
    tail=0,
    reach=_LEG,
    half_width=_LEG + 0.6,
    open_pf=0.6,  # a disk of 5 mm at 0.3 mm of air: eps0 pi 2.5^2 / 0.3 mm
)

_TACT_VIA = 0.0, -0.6
_TACT_SIDE = [(0.0, -2.7), (-2.4, -2.7), (-2.4, -1.5), (-2.4, 1.5), (-2.4, 2.7), (0.0, 2.7)]

TACT = SwitchPart(
    Part(
        "TACT_4.5MM",
        "tact switch, 4.5x4.5 mm, 1 N (100 gf); compare its drawing with these pads, they were drawn without it",
        (*(Pad(n, x, y, 1.2, 0.9) for n, x in (("1", -2.4), ("2", 2.4)) for y in (-1.5, 1.5)),),
        6.2,
        4.7,
        article=("E-Switch", "TL3315NF100Q"),
    ),
    force_n=1.0,
    travel_mm=0.25,
    height_mm=0.55,
    closed_by=1.5,
    column=tuple((*a, *b) for a, b in itertools.pairwise(_TACT_SIDE)),
    diode=((2.4, 1.5, 2.4, -1.5), (2.4, -1.5, 0.0, -1.5), (0.0, -1.5, *_TACT_VIA)),
    via=_TACT_VIA,
    tail=2,
    reach=2.7,
    half_width=3.0,
    open_pf=0.5,
)

_TOOTH_MM = 0.25
"""Width of a comb's teeth, and of the gaps between them."""
_GAP_PF_MM = 0.037
"""Capacitance per length of a gap, by :func:`contactfpga.design.sheet.extract.beside_pf` on FR-4."""
_COMB_HOLE_MM = 0.6
"""Half of what teeth leave free around the via in the middle."""


def comb(pitch_x_mm: float, pitch_y_mm: float) -> SwitchPart:
    """Two combs of bare copper for a resistive film, as large as the pitch leaves room for: teeth along x, those of the
    column from a spine on the left, those of the diode from one on the right."""
    step = 2 * _TOOTH_MM
    most = max(3, int((pitch_y_mm / 2 - 0.35) / step + 1e-9))
    last = most - 1 + most % 2  # odd, so that the outermost teeth are the column's
    reach = last * step
    half = min(reach + _TOOTH_MM / 2, pitch_x_mm / 2 - 0.5)  # a row's via fits beside it
    spine = half - _TOOTH_MM / 2
    pads = [
        Pad("1", -spine, 0.0, _TOOTH_MM, 2 * reach + _TOOTH_MM),
        Pad("2", spine, 0.0, _TOOTH_MM, 2 * reach - 2 * step + _TOOTH_MM),
    ]
    for number in range(-last, last + 1):
        y = number * step
        free = -_COMB_HOLE_MM if abs(y) < 1.5 * step else half - step
        side, left, right = ("1", -half, free) if number % 2 else ("2", -free, half)
        pads.append(Pad(side, (left + right) / 2, y, right - left, _TOOTH_MM))
    name = f"COMBS_{2 * half:.2f}x{2 * reach + _TOOTH_MM:.2f}MM"
    part = Part(name, "", tuple(pads), 2 * half, 2 * reach + _TOOTH_MM, pasted=False, soldered=False)
    column = (0.0, -reach), (-spine, -reach), (-spine, reach), (0.0, reach)
    return SwitchPart(
        part,
        force_n=0.0,
        travel_mm=0.0,
        height_mm=0.1,
        closed_by=2 * half,
        column=tuple((*a, *b) for a, b in itertools.pairwise(column)),
        diode=((spine, 0.0, 0.0, 0.0),),
        via=(0.0, 0.0),
        tail=0,
        reach=reach,
        half_width=half,
        open_pf=_GAP_PF_MM * 2 * last * (2 * half - step),
    )


SWITCHES = {"dome": DOME, "tact": TACT}
"""The available switches, by the command's name."""


def find_switch(name: str) -> SwitchPart:
    if name not in SWITCHES:
        raise SheetError(f"part is {shown(name)}; it must be one of {', '.join(SWITCHES)}")
    return SWITCHES[name]


def _code(ohms: float) -> str:
    """A resistance as a maker's number has it, such as 5K6; "" outside the E24 series."""
    size, letter = next(one for one in ((1e6, "M"), (1e3, "K"), (1.0, "R"), (0.0, "")) if ohms >= one[0])
    if not letter or f"{ohms:.6e}"[:8].replace(".", "").rstrip("0").ljust(2, "0") not in map(str, _E24):
        return ""
    whole, _, part = f"{ohms / size:g}".partition(".")
    return f"{whole}{letter}{part}"


def _pair(reach: float, width: float, height: float) -> tuple[Pad, Pad]:
    return Pad("1", -reach, 0.0, width, height), Pad("2", reach, 0.0, width, height)


DIODE = Part(
    "D_SOD-323",
    "Schottky diode, SOD-323; pad 1 is the cathode",
    _pair(1.1, 0.8, 0.6),
    3.3,
    1.4,
    marks=((-1.8, -0.5, -1.8, 0.5),),
    article=("Vishay", "BAT54WS-E3-08"),
)
SILICON_DIODE = dataclasses.replace(
    DIODE, order="silicon diode, SOD-323; pad 1 is the cathode", article=("Vishay", "1N4148WS-E3-08")
)
RESISTOR = Part("R_0603", "resistor, 0603, 1 %", _pair(0.8, 0.8, 0.8), 2.7, 1.3, article=("Yageo", "RC0603FR-07{}L"))
CAPACITOR = Part(
    "C_0603", "capacitor, 0603, X7R, 50 V", _pair(0.8, 0.8, 0.8), 2.7, 1.3, article=("Yageo", "CC0603KRX7R9BB104")
)


def column_capacitor(pf: float, tolerance: float) -> Part:
    """A capacitor whose value heat does not move; of 220 pF, those of 5 and 2 % have a number."""
    articles = {0.05: ("Yageo", "CC0603JRNPO9BN221"), 0.02: ("Murata", "GRM1885C1H221GA01D")}
    article = articles.get(tolerance, ("", "")) if pf == 220 else ("", "")
    order = f"capacitor, 0603, C0G (NP0), {100 * tolerance:g} %, 50 V"
    return dataclasses.replace(CAPACITOR, order=order, article=article)


FIDUCIAL = Part(
    "FIDUCIAL",
    "mark for an assembler's camera",
    (Pad("1", 0.0, 0.0, 1.0, 1.0, round=True),),
    3.0,
    3.0,
    pasted=False,
    soldered=False,
    mask_mm=0.5,
)


def _soic16(name: str) -> Part:
    """Pins 1 to 8 below from the left, 9 to 16 above from the right, 1.27 mm apart (JEDEC MS-012)."""
    places = [(k * 1.27 - 4.445, 2.475) for k in range(8)] + [(4.445 - k * 1.27, -2.475) for k in range(8)]
    pads = (Pad(str(number + 1), x, y, 0.6, 1.95) for number, (x, y) in enumerate(places))
    marks, article = ((-5.3, 1.2, -5.3, 3.2),), ("Texas Instruments", f"SN{name}DR")
    return Part("SOIC-16", f"{name}, SOIC-16", tuple(pads), 10.4, 7.4, marks=marks, article=article, library_turn=90)


HC595 = _soic16("74HC595")
LVC595 = dataclasses.replace(_soic16("74LVC595A"), article=("Nexperia", "74LVC595AD"))
"""With the pins of the 74HC595, for 1.2 to 3.6 V."""
LVC_OHM = 25.0
"""Resistance of its outputs, rounded up: at most 0.55 V at 24 mA and 3 V, the usual limit of the family."""
HC165 = _soic16("74HC165")

HEADER_PINS = 10, 14, 16, 20, 26, 34, 40


def header(pins: int) -> Part:
    """A shrouded header of two rows, 2.54 mm apart; odd pins are below, even pins above, from the left."""
    first = -(pins // 2 - 1) * 1.27
    places = [(first + k // 2 * 2.54, 1.27 - k % 2 * 2.54) for k in range(pins)]
    pads = (Pad(str(k + 1), x, y, 1.7, 1.7, round=True, drill=1.0) for k, (x, y) in enumerate(places))
    mark = (first - 1.2, 2.6, first + 1.2, 2.6)
    order = f"shrouded header, 2x{pins // 2} pins, straight, 2.54 mm, keyed, for a ribbon cable"
    width, article = pins // 2 * 2.54 + 7.7, ("Adam Tech", f"BHR-{pins:02d}-VUA")
    name = f"IDC_2x{pins // 2:02d}"
    return Part(name, order, tuple(pads), width, 9.2, pasted=False, marks=(mark,), article=article, library_turn=90)


def smallest_header(pins: int, sizes: Iterable[int] = HEADER_PINS) -> int:
    return min(size for size in sizes if size >= pins)
