"""Covers that a kit could have: peak forces of the paper's arm on a rigid body, miscounts and delay of each."""

from __future__ import annotations

import dataclasses
from concurrent.futures import Executor
from typing import NamedTuple

from contactfpga.design import kits
from contactfpga.design.cover import Bed, Cover, load_cover
from contactfpga.skin import Skin
from contactfpga_sim.apps import pool
from contactfpga_sim.lab import writer
from contactfpga_sim.lab.arm import anywhere, places
from contactfpga_sim.lab.arm.case import Case
from contactfpga_sim.lab.kits import counts, predict

KIT = kits.kit("starter")
PADS = 4
FINGERS, PAIR = counts.SCENES[0], counts.SCENES[2]
TIMES = (1, 2)
"""Speeds of the arm, in those of the case."""


class Choice(NamedTuple):
    """Tiles of the kit's foam on its caps, on square pads of the same foam below the board."""

    foam_mm: float
    bed_mm: float = 0.0
    """Thickness of the pads; 0: the board is fixed to the link."""
    pad_mm: float = 20.0
    stiff: float = 1.0
    """Factor of the foam's modulus."""

    @property
    def cover(self) -> Cover:
        stated = load_cover(KIT.skin_path)
        assert stated is not None
        cover = dataclasses.replace(
            stated, thickness_m=1e-3 * self.foam_mm, modulus_pa=self.stiff * stated.modulus_pa, bed=None
        )
        if not self.bed_mm:
            return cover
        assert stated.bed is not None
        bed = Bed(1e-3 * self.bed_mm, PADS * 1e-6 * self.pad_mm**2, stated.bed.mass_kg)
        return dataclasses.replace(cover, bed=bed)

    def __str__(self) -> str:
        pads = f", pads of {self.bed_mm:g} x {self.pad_mm:g} x {self.pad_mm:g} mm" if self.bed_mm else ""
        stiff = f", foam {self.stiff:g} times as stiff" if self.stiff != 1 else ""
        return f"tiles of {self.foam_mm:g} mm{pads}{stiff}"

    def felt(self, workers: Executor) -> tuple[str, str, str]:
        """Miscounted scenes, and the time from a finger's first touch until it is felt. Pads change neither."""
        cover = dataclasses.replace(self.cover, bed=None)
        fingers, pair = (counts.share(counts.miscounted(KIT.skin, cover, each, workers)) for each in (FINGERS, PAIR))
        level = predict.pressing(cover, {"spread": 0.0})
        return fingers, pair, f"{predict.measured(level, KIT.skin, 0)['first_closing_ms']:.1f}"


CHOICES = (
    Choice(2),
    Choice(3),
    Choice(4),
    Choice(6),
    Choice(2, 10),
    Choice(2, 20),
    Choice(2, 20, stiff=0.7),
    Choice(2, 20, stiff=1.3),
    Choice(3, 10),
)
LESS = (Choice(3), Choice(2, 10))
"""Those that the page leaves out."""
HEAD = (
    "cover",
    "fingers miscounted",
    "two fingers 10 mm apart miscounted",
    "felt after, ms",
    *(f"{way}{speed}: worst / mean, N" for speed in ("", ", twice the speed") for way in ("6 ms", "limit alone")),
)


def beds_table() -> writer.Table:
    paper = Case.load("paper")
    dressed = {str(one): (paper.wearing(one.cover), KIT.skin) for one in CHOICES}
    dressed["the paper's sheet"] = (anywhere.FLUSH.case(), Skin())
    tasks = {
        (name, times): places.batches(
            case.but(body="rigid", link={"speed_m_s": times * paper.link.speed_m_s}),
            skin,
            ((6e-3,), ()),
            anywhere.TOUCHES,
        )
        for name, (case, skin) in dressed.items()
        for times in TIMES
    }
    with pool.executor() as workers:
        found = anywhere.many(tasks, workers)
        felt = {str(one): one.felt(workers) for one in CHOICES}
    rows = []
    for name in dressed:
        peaks = [anywhere.peak_text(halves) for times in TIMES for halves in found[name, times]]
        rows.append((name, *felt.get(name, ("", "", "")), *peaks))
    return writer.Table(HEAD, rows, lambda row: row[0] not in map(str, LESS))
