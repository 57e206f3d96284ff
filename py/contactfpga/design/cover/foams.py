"""Foams by name, with the sources of their values.

From data sheets with the stress at 25 % compression, the modulus is that stress over 0.25, a secant below the initial
slope. A soft foam's Poisson ratio falls under compression: 0.5 at 5 %, about 0 at 66 % (doi
10.1016/j.ijengsci.2007.09.002).
"""

from __future__ import annotations

import dataclasses

from contactfpga.design.cover.answer import CoverError, positive
from contactfpga.inputs.values import is_finite, shown


@dataclasses.dataclass(frozen=True)
class Foam:
    """A material for the cover."""

    name: str
    modulus_pa: float
    """Young's modulus."""
    source: str
    """Source and derivation of the values."""
    density_kg_m3: float | None = None
    yield_pa: float | None = None
    """Yield strength Y; None excludes (7) and (8)."""
    strain: float = 1.0
    """Largest relative compression with a stress in the source, else 1."""
    curve: tuple[tuple[float, float], ...] = ()
    """Published strains, and stresses in Pa."""

    @property
    def layer_pa(self) -> float:
        """E of p = E e / (1 - e) (:class:`contactfpga.design.cover.layers.Layer`), the mean over the curve; without
        one, :attr:`modulus_pa`."""
        fits = [stress * (1 - strain) / strain for strain, stress in self.curve]
        return sum(fits) / len(fits) if fits else self.modulus_pa

    def __post_init__(self) -> None:
        positive("modulus_pa", self.modulus_pa, "Pa")
        for name, unit in (("density_kg_m3", "kg/m3"), ("yield_pa", "Pa")):
            if getattr(self, name) is not None:
                positive(name, getattr(self, name), unit)
        for name in ("name", "source"):
            text = getattr(self, name)
            if not isinstance(text, str) or not text.isprintable():
                raise CoverError(f"{name} is {shown(text)}; it must be a text that can be printed, on one line")
        if not is_finite(self.strain) or not 0 < self.strain <= 1:
            raise CoverError(f"strain is {shown(self.strain)}; it must lie above 0 and not above 1")


_PAPER = "paper, IV.A: E printed"
_PORON = "Rogers, PORON 4701-30 Very Soft Supported, typical values (en.sekorm.com, document 110171): "

FOAMS = (
    Foam(
        "paper",
        3.45e5,
        f"{_PAPER}; Y from the printed U_r = 4791 J/m3 by Y^2 = 2 E U_r; density not printed",
        yield_pa=57.5e3,
    ),
    Foam(
        "paper, Y printed",
        3.45e5,
        f"{_PAPER}; Y = 8.41e5 Pa printed, which makes the yield check vacuous; density not printed",
        yield_pa=8.41e5,
    ),
    Foam(
        "PORON 4701-30, 320",
        34e3 / 0.25,
        _PORON + "20 lb/ft3 (320 kg/m3), 34 kPa at 25 %; sold 1.6 to 2.4 mm thick",
        density_kg_m3=320.0,
        strain=0.25,
        curve=((0.25, 34e3),),
    ),
    Foam(
        "PORON 4701-30, 400",
        58e3 / 0.25,
        _PORON + "25 lb/ft3 (400 kg/m3), 58 kPa at 25 %; sold 0.5 to 1.2 mm thick",
        density_kg_m3=400.0,
        strain=0.25,
        curve=((0.25, 58e3),),
    ),
    Foam(
        "Plastazote LD33",
        40e3 / 0.25,
        "Zotefoams, Plastazote LD33, typical values (customfoams.co.uk/shop/plastazote-ld33): 33 kg/m3, 40 kPa at "
        "25 %, 75 at 40 %, 115 at 50 %, 175 kPa at 60 %",
        density_kg_m3=33.0,
        strain=0.6,
        curve=((0.25, 40e3), (0.4, 75e3), (0.5, 115e3), (0.6, 175e3)),
    ),
    Foam(
        "Sylomer W",
        5e3 / 0.04,
        "Getzner, Sylomer W (yumpu.com document 6168404): 5 kPa at about 4 %, peaks of 0.3 MPa at about 80 %; density "
        "not given",
        strain=0.8,
        curve=((0.04, 5e3), (0.8, 0.3e6)),
    ),
    Foam(
        "Sylodyn ND",
        0.35e6 / 0.10,
        "Getzner, Sylodyn ND (scribd.com document 365619544): 0.35 MPa at about 10 %, peaks of 4 MPa at about 60 %; "
        "density not given",
        strain=0.6,
        curve=((0.1, 0.35e6), (0.6, 4e6)),
    ),
)


def find(name: str, foams: tuple[Foam, ...] = FOAMS) -> Foam:
    """The foam of this name; raises CoverError."""
    for foam in foams:
        if foam.name == name:
            return foam
    raise CoverError(f"foam is {shown(name)}; known are {', '.join(repr(foam.name) for foam in foams)}")
