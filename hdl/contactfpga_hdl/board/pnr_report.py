"""Results of place and route."""

from __future__ import annotations

import dataclasses
import json
import re
from pathlib import Path

FILE = "report.json"


@dataclasses.dataclass(frozen=True)
class Report:
    luts: tuple[int, int]
    """4-input look-up tables, used and available."""
    flip_flops: int
    block_rams: tuple[int, int]
    logic_cells: tuple[int, int] | None
    """Cells of one LUT and one flip-flop, used and available, the limiting resource of an iCE40; otherwise None."""
    fmax_mhz: float
    needed_mhz: float

    @property
    def met(self) -> bool:
        return self.fmax_mhz >= self.needed_mhz

    def lines(self) -> list[str]:
        rows = [("LUT4", f"{self.luts[0]} of {self.luts[1]}"), ("flip-flops", str(self.flip_flops))]
        if self.logic_cells is not None:
            rows.append(("logic cells", f"{self.logic_cells[0]} of {self.logic_cells[1]}"))
        rows.append(("block RAMs", f"{self.block_rams[0]} of {self.block_rams[1]}"))
        rows.append(("Fmax", f"{self.fmax_mhz:.1f} MHz, needed {self.needed_mhz:g} MHz"))
        return [f"{name:12} {value}" for name, value in rows]


def read(folder: Path, log: str) -> Report:
    """Results of nextpnr in ``folder``: its report, and for an iCE40 its log."""
    figures = json.loads((folder / FILE).read_text(encoding="utf-8"))
    cells = {name: (cell["used"], cell["available"]) for name, cell in figures["utilization"].items()}
    clock = min(figures["fmax"].values(), key=lambda clock: clock["achieved"] / clock["constraint"])
    if "ICESTORM_LC" in cells:
        packed = (folder / log).read_text(encoding="utf-8")
        luts, flip_flops = _packed(packed, "LUT4"), _packed(packed, "DFF")
        logic_cells = cells["ICESTORM_LC"]
        rams, there = cells["ICESTORM_RAM"], logic_cells[1]
    else:
        (luts, there), rams, logic_cells = cells["TRELLIS_COMB"], cells["DP16KD"], None
        flip_flops = cells["TRELLIS_FF"][0]
    return Report(
        luts=(luts, there),
        flip_flops=flip_flops,
        block_rams=rams,
        logic_cells=logic_cells,
        fmax_mhz=clock["achieved"],
        needed_mhz=clock["constraint"],
    )


def _packed(log: str, kind: str) -> int:
    return sum(int(count) for count, kinds in re.findall(r"(\d+) LCs used as (.*)", log) if kind in kinds)
