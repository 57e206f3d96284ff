"""Tables of docs/kits.md and the README."""

from __future__ import annotations

import collections
import functools
import itertools
import tempfile
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import NamedTuple

from contactfpga.boards.wiring import ohms
from contactfpga.design import kits, predictions
from contactfpga.design.cover import Cover, load_cover
from contactfpga.design.kits import Kit
from contactfpga.design.sheet import files
from contactfpga.skin import Skin
from contactfpga_hdl.board import build, pnr_report
from contactfpga_sim.apps import covers, pool
from contactfpga_sim.apps.latency import stages
from contactfpga_sim.apps.latency.spread import Spread
from contactfpga_sim.apps.latency.stages import Finger
from contactfpga_sim.apps.latency.usb import BridgeSettings
from contactfpga_sim.apps.stats import Rate
from contactfpga_sim.lab import writer
from contactfpga_sim.lab.arm import anywhere
from contactfpga_sim.lab.arm import kits as kits_arm
from contactfpga_sim.lab.kits import counts, predict
from contactfpga_sim.lab.kits.counts import Drawn

NAMES = ("starter", "fast")
SEEDS = (1, 2, 3)
"""Seeds of place and route."""
PEAKS = {
    "UART": "of an arm that runs into a body anywhere, worst / mean",
    "6 ms": "if the stop comes 6 ms late",
    "limit alone": "if no stop comes and only the limit of torque holds",
}
"""Words of the README's row for each of :data:`contactfpga_sim.lab.arm.anywhere.WAYS`."""
BODIES = ("forearm", "rigid")
"""The softest and the stiffest body that the arm may run into."""


class KitFigures(NamedTuple):
    kit: Kit
    finger: Finger
    built: tuple[pnr_report.Report, ...]


def compute() -> list[KitFigures]:
    return [_figures(kits.kit(name)) for name in NAMES]


def _figures(kit: Kit) -> KitFigures:
    finger = stages.measure(kit.skin, BridgeSettings(kit.board.bridge), host_touches=0)
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
    skin = found[0].kit.skin
    paper = skin, covers.paper(skin.pitch_x_mm)
    *fingers, paper_fingers = (counts.share(rate) for rate in _rates(counts.FINGERS, paper))
    rows = [
        ("", "kits", "compared with"),
        (
            "[Closed switch to the controller's decision](docs/kits.md#from-the-finger-to-your-code), over USB "
            "with 0.1 ms assumed for the host, worst / median",
            _of_kits(decision),
            "6,000 us for the paper's sheet and control together",
        ),
        (
            "[Closed switch to the last byte on the wire](docs/kits.md#from-the-finger-to-your-code), worst / median",
            _of_kits(byte),
            "up to 1,000 us until the next scan of a 1 kHz array",
        ),
        (
            "[Closed switch to the pin `contact`](docs/kits.md#from-the-finger-to-your-code), worst / median",
            _of_kits(pin),
            "the same",
        ),
        (
            f"[Scenes of {counts.FINGERS.name}](docs/kits.md#how-many-touches) miscounted, 95 % interval",
            _of_kits(f"**{one}**" for one in fingers),
            f"{paper_fingers} with the paper's switch and foam at this pitch",
        ),
        *_peak_rows(found),
    ]
    return writer.table_of(rows)


def _of_kits(values: Iterable[str]) -> str:
    """What each kit has, in one cell, so that the table fits a phone."""
    texts = tuple(values)
    if len(set(texts)) == 1:
        return f"both {texts[0]}"
    return "; ".join(f"{name} {text}" for name, text in zip(NAMES, texts, strict=True))


def _shown(one: KitFigures) -> tuple[str, str, str]:
    finger, digits = one.finger, 1 if one.kit.name == "fast" else 0
    return (
        f"**{_worst_first(finger.decision_us)}**",
        f"**{_worst_first(finger.board.touch_to_last_byte_us, digits)}**",
        f"**{_worst_first(finger.board.touch_to_contact_us, 2 if digits else 0)}**",
    )


def _rates(scenes: Drawn, *beside: tuple[Skin, Cover]) -> list[Rate]:
    """Miscounted scenes of both kits, and of the sheets in ``beside``."""
    sheets = [(kit.skin, load_cover(kit.skin_path)) for kit in map(kits.kit, NAMES)]
    with pool.executor() as workers:
        return [counts.miscounted(*sheet, scenes, workers) for sheet in (*sheets, *beside)]


def counts_table() -> str:
    rows = [(scenes.name, *(counts.share(rate) for rate in _rates(scenes))) for scenes in counts.SCENES]
    return writer.table_of([("scenes", *NAMES), *rows])


def _peak_rows(found: list[KitFigures]) -> Iterator[tuple[str, ...]]:
    study = kits_arm.study([kits_arm.worn(one.kit, one.finger) for one in found], BODIES, (1,))
    with pool.executor() as workers:
        peaks = {(each.sheet, each.body): halves for each, halves in anywhere.many(study, workers).items()}

    def cell(sheet: str, way: str, mark: str = "") -> str:
        texts = (anywhere.peak_text(peaks[sheet, body][anywhere.WAYS.index(way)]) for body in BODIES)
        return ", ".join(f"{mark}{text} N{mark} {body}" for text, body in zip(texts, BODIES, strict=True))

    for way, what in PEAKS.items():
        kits_n = _of_kits(cell(one.kit.name, way, "**") for one in found)
        yield f"[Peak force](docs/arm.md#the-kits) {what}", kits_n, f"{cell('paper', way)} with the paper's sheet"


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
        counted: collections.Counter[tuple[str, ...]] = collections.Counter()
        for one in kit.layout.drawing.placed:
            if one.value:  # a fiducial is copper
                ohm = ohms(float(one.value)) if one.value.isdigit() else ""
                article = " ".join(filter(None, (one.part.article[0], one.part.number(one.value))))
                counted[one.part.order, ", ".join(filter(None, (ohm, article)))] += 1
        for (order, shown), count in counted.items():
            rows.append((name, "sheet", str(count), order, shown))
        for other in kit.parts:
            maker = " ".join(filter(None, (other.maker, other.number)))
            rows.append((name, "beside it", str(other.count), other.what, maker))
    head = ("kit", "where", "count", "what", "value or maker's number")
    others = {row[2:] for row in rows if row[0] == NAMES[0]}
    return writer.Table(head, rows, lambda row: row[1] == "beside it" and row[2:] not in others, head[2:])


def wiring_table() -> str:
    """The single wires of the fast kit: its sheet's connectors side by side, then the wires without the sheet."""
    found = files.connections(kits.kit("fast").layout)
    others = [("", f"`{wire}`: {leads_to}", place) for *_, wire, leads_to, place in found.pop("")]
    columns = [[(pin, f"`{wire}`", place) for _, pin, wire, _, place in rows] for rows in found.values()]
    head = [cell for name in found for cell in (f"{name} of the sheet", "wire", "ULX3S")]
    lines = [[*itertools.chain(*line)] for line in zip(*columns, strict=True)]
    return writer.table_of([head, *lines, *([*one, "", "", ""] for one in others)])


PREDICTED = ("contact_worst_us", "break_worst_us", "settle_us", "felt_half_n", "first_closing_ms", "closing_rod_n")
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


WIDE = 0.9
"""Lowest factor of tolerances that the page does not show."""


def tolerances_table() -> writer.Table:
    rows = [
        (one.what, f"{one.low:.3g} to {one.high:.3g}", one.source)
        for one in (*predict.COVER.values(), *predict.CIRCUIT.values())
    ]
    wide = [one.what for one in predict.COVER.values() if one.low < WIDE]
    return writer.Table(("times the stated value", "factor", "source"), rows, lambda row: row[0] in wide)


def _interval(one: predictions.Prediction) -> str:
    return f"{one.value:g} ({one.low:g} to {one.high:g})"
