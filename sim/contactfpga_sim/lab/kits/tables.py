"""Tables of docs/kits.md and the README."""

from __future__ import annotations

import collections
import csv
import functools
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

from contactfpga.boards.wiring import ohms
from contactfpga.design import kits, predictions
from contactfpga.design.circuit import load_circuit
from contactfpga.design.cover import load_cover
from contactfpga.design.kits import Kit
from contactfpga.design.sheet import lay_out
from contactfpga.driver import health
from contactfpga_hdl.board import build, pnr_report
from contactfpga_sim.apps import pool
from contactfpga_sim.apps.latency import stages
from contactfpga_sim.apps.latency.spread import Spread
from contactfpga_sim.apps.latency.stages import Finger
from contactfpga_sim.apps.latency.usb import BridgeSettings
from contactfpga_sim.lab import writer

NAMES = ("starter", "fast")
SEEDS = (1, 2, 3)
"""Seeds of place and route."""
COVER = "| run, 6.4 mm, tiles |"
PAPER = "| run, 6.4 mm, paper |"
PEAKS = {
    "UART": "that an arm runs into anywhere, worst / mean",
    "6 ms": "if the stop comes 6 ms late",
    "limit alone": "if no stop comes and only the limit of torque holds",
}
"""Columns of :data:`PLACES`, and what a row of the README says of them."""
PLACES = "docs/tables/arm-places.csv"
PAPER_SHEET = ("flush, point force", 10.0, 1.0, 5.0)
"""Face, pitch in mm, threshold in N and foam in mm of a row there."""


class KitFigures(NamedTuple):
    kit: Kit
    finger: Finger
    built: tuple[pnr_report.Report, ...]


def compute() -> list[KitFigures]:
    return [_figures(kits.kit(name)) for name in NAMES]


def _figures(kit: Kit) -> KitFigures:
    settings = BridgeSettings(kit.board.bridge, health.LATENCY_MS, health.EVENT_CHAR & 0xFF)
    finger = stages.measure(kit.skin, settings, host_touches=0)
    with pool.executor() as workers:
        return KitFigures(kit, finger, tuple(workers.map(functools.partial(_built, kit), SEEDS)))


def _built(kit: Kit, seed: int) -> pnr_report.Report:
    with tempfile.TemporaryDirectory() as folder:
        return build.build(kit.skin, kit.board, Path(folder), seed)


def _worst_first(us: Spread, digits: int = 0) -> str:
    return f"{us.worst:,.{digits}f} / {us.median:,.{digits}f} us"


def headline(found: list[KitFigures]) -> str:
    """The README's table: both kits, and comparisons."""
    decision, byte, pin = zip(*(_shown(one) for one in found), strict=True)
    fingers, paper_fingers = (_of_page("chart.md", start, 2) for start in (COVER, PAPER))
    rows = [
        ("", *(f"{one.kit.name} kit" for one in found), "compared with"),
        (
            "[Closed switch to the controller's decision](docs/kits.md#from-the-finger-to-your-code), over USB "
            "with 0.1 ms assumed for the host, worst / median",
            *decision,
            "6,000 us for the paper's sheet and control together",
        ),
        (
            "[Closed switch to the last byte on the wire](docs/kits.md#from-the-finger-to-your-code), worst / median",
            *byte,
            "up to 1,000 us until the next scan of a 1 kHz array",
        ),
        (
            "[Closed switch to the pin `contact`](docs/kits.md#from-the-finger-to-your-code), worst / median",
            *pin,
            "the same",
        ),
        (
            "[Scenes of two to five fingers miscounted](docs/chart.md#every-method), 95 % interval",
            *(f"**{fingers}**",) * 2,
            f"{paper_fingers} with the paper's switch and foam at this pitch",
        ),
        *(_peak_row(way, found) for way in PEAKS),
    ]
    return writer.table_of(rows)


def _shown(one: KitFigures) -> tuple[str, str, str]:
    finger, digits = one.finger, 1 if one.kit.name == "fast" else 0
    return (
        f"**{_worst_first(finger.decision_us)}**",
        f"**{_worst_first(finger.board.touch_to_last_byte_us, digits)}**",
        f"**{_worst_first(finger.board.touch_to_contact_us, 2 if digits else 0)}**",
    )


def _of_page(page: str, start: str, column: int) -> str:
    text = Path("docs", page).read_text(encoding="utf-8")
    found = [line for line in text.splitlines() if line.startswith(start) and ";" in line]
    return found[0].strip("|").split("|")[column].split(";")[0].strip(" *")


def _sheet(kit: Kit) -> tuple[str, float, float, float]:
    cover = load_cover(kit.skin_path)
    assert cover is not None
    return ("tiles", kit.skin.pitch_x_mm, cover.switch.force_n, round(1e3 * cover.thickness_m, 3))


def _peak_row(way: str, found: list[KitFigures]) -> tuple[str, ...]:
    title = f"[Peak force on a human arm](docs/arm.md#touches-anywhere) {PEAKS[way]}"
    kits_n = (f"**{_peak(sheet, way)} N**, {sheet[-1]:g} mm of foam" for sheet in (_sheet(one.kit) for one in found))
    paper_n = f"{_peak(PAPER_SHEET, way)} N with the paper's sheet, {PAPER_SHEET[-1]:g} mm of foam"
    return title, *kits_n, paper_n


def _peak(sheet: tuple[str, float, float, float], way: str) -> str:
    """Worst / mean in N."""
    with open(PLACES, encoding="utf-8", newline="") as file:
        of = {(row["face"], *map(float, list(row.values())[1:4])): row for row in csv.DictReader(file)}
    mean, worst = of[sheet][f"{way}: mean / worst, N"].split(" / ")
    return f"{worst} / {mean}"


def times_table(found: list[KitFigures]) -> writer.Table:
    rows = [row for one in found for row in _stages(one)]
    head = ("kit", "stage", "median, us", "99 %, us", "worst, us")
    return writer.Table(head, rows, lambda row: "USB controller" not in row[1])


def _stages(one: KitFigures) -> Iterator[tuple[str, ...]]:
    finger = one.finger
    for stage, us in (
        ("closed switch to the pin `contact`", finger.board.touch_to_contact_us),
        ("closed switch to the last byte on the wire", finger.board.touch_to_last_byte_us),
        ("last byte to the host's USB controller", finger.bridge_us),
        ("closed switch to the host's USB controller", finger.usb_us),
        (f"closed switch to the decision, {stages.ASSUMED_HOST_US:g} us assumed for the host", finger.decision_us),
    ):
        yield (one.kit.name, stage, *(f"{value:,.2f}" for value in (us.median, us.p99, us.worst)))


def built_table(found: list[KitFigures]) -> str:
    """FPGA resources of each kit; Fmax is the slowest of :data:`SEEDS`."""
    lines = []
    for one in found:
        first, slowest = one.built[0], min(one.built, key=lambda report: report.fmax_mhz)
        margin = slowest.fmax_mhz / slowest.needed_mhz
        lines.append(
            writer.line(
                (
                    one.kit.name,
                    one.kit.board.fpga,
                    f"{first.luts[0]:,} of {first.luts[1]:,}",
                    f"{first.block_rams[0]} of {first.block_rams[1]}",
                    f"{slowest.fmax_mhz:.1f} MHz",
                    f"{slowest.needed_mhz:.0f} MHz, {margin:.2f} times",
                )
            )
        )
    return writer.table(("kit", "FPGA", "LUT4", "block RAMs", f"Fmax, slowest of {len(SEEDS)} seeds", "needed"), lines)


def parts_table() -> writer.Table:
    rows = []
    for name in NAMES:
        kit = kits.kit(name)
        layout = lay_out(kit.skin, load_circuit(kit.skin_path))
        counted = collections.Counter((one.part.order, one.value) for one in layout.drawing.placed)
        for (order, value), count in counted.items():
            shown = ohms(float(value)) if value.isdigit() else ""
            rows.append((name, "sheet", str(count), order, shown))
        for other in kit.parts:
            maker = " ".join(filter(None, (other.maker, other.number)))
            rows.append((name, "beside it", str(other.count), other.what, maker))
    head = ("kit", "where", "count", "what", "value or maker's number")
    return writer.Table(head, rows, lambda row: row[:2] == (NAMES[1], "beside it"), head[2:])


PREDICTED = ("contact_worst_us", "break_worst_us", "settle_us", "felt_half_n")
"""Predictions that the page shows."""


def predictions_table() -> writer.Table:
    both = {name: predictions.load(kits.kit(name)) for name in NAMES}
    lines = []
    for key in dict.fromkeys(key for found in both.values() for key in found):
        any_one = next(found[key] for found in both.values() if key in found)
        cells = [_interval(both[name][key]) if key in both[name] else "" for name in NAMES]
        lines.append((f"`{key}`", any_one.what, any_one.unit, *cells))
    head = ("name", "what", "unit", *NAMES)
    return writer.Table(head, lines, lambda row: row[0].strip("`") in PREDICTED, head[1:])


def _interval(one: predictions.Prediction) -> str:
    return f"{one.value:g} ({one.low:g} to {one.high:g})"
