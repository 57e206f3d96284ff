"""The table and the picture of docs/support.md."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from pathlib import Path

import matplotlib
import numpy as np
from matplotlib.patches import Polygon, Rectangle

from contactfpga import picture_style as style
from contactfpga_sim.apps.stats import quantile, wilson
from contactfpga_sim.lab import writer
from contactfpga_sim.lab.support import brace, compute, robot
from contactfpga_sim.lab.support.compute import DESIGNS, MODELS, Outcome

SHOWN = (
    "contact",
    "held, elements",
    "center, elements",
    "area, model",
    "area, elements",
    "rectangle, elements",
)
DRAWN = (("bumper", 2), ("bar", 0), ("fingers", 5))


def surfaces_table(found: dict[tuple[str, str, str], list[Outcome]]) -> writer.Table:
    """A row for each design and kind of contact; the page leaves out the pair, a kind of fingers."""
    parts = ("held", "center", "area", "rectangle", "force", "two said", "one said two")
    head = ["cells", "contact", *(f"{part}, {model}" for part in parts for model in MODELS)]
    rows = []
    for design, kind in dict.fromkeys(key[:2] for key in found):
        columns = zip(*(_row(found[design, kind, model]) for model in MODELS))
        rows.append([design, kind, *(cell for both in columns for cell in both)])
    best = next(iter(DESIGNS))
    return writer.Table(head, rows, lambda row: row[0] == best and row[1] != "pair", SHOWN)


def _row(judged: list[Outcome]) -> list[str]:
    zones = [zone for one in judged for zone in one.zones]
    return [
        _share([held for one in judged for held in one.held]),
        _share([zone.center for zone in zones]),
        *(_ratio([zone[field] for zone in zones]) for field in (1, 2)),
        _least([share for one in judged for share in one.force]),
        _share([zone.doubted for zone in zones if zone.several]),
        _share([zone.doubted for zone in zones if not zone.several]),
    ]


def _share(hits: Sequence[bool]) -> str:
    if not hits:
        return "none"
    low, high = wilson(sum(hits), len(hits))
    return f"{sum(hits)} of {len(hits)} ({100 * low:.0f} to {100 * high:.0f} %)"


def _ratio(values: Sequence[float]) -> str:
    half, most = quantile(values, 0.5), quantile(values, 0.99)
    end = f"from {most.low:.2f}" if math.isinf(most.high) else f"{most.low:.2f} to {most.high:.2f}"
    return f"{half.value:.2f} ({half.low:.2f} to {half.high:.2f}); {most.value:.2f} ({end})"


def _least(shares: Sequence[float]) -> str:
    half, least = quantile(shares, 0.5), quantile(shares, 0.01)
    return f"{100 * half.value:.0f} %; {100 * least.value:.0f} % (up to {100 * least.high:.0f})"


def leans_table(found: list[robot.Lean] | None = None) -> writer.Table:
    """A row for each link and kind of support; the page has those of each link, the worst first."""
    found = robot.lean_all() if found is None else found
    head = ["link", "supports", "felt", "center in the polygon", "held", "area", "area of the rectangle"]
    head += ["wrench, one zone", "wrench, several zones"]
    links, kinds = ([*dict.fromkeys(getattr(one, field) for one in found)] for field in ("link", "kind"))
    by_link = {link: [one for one in found if one.link == link] for link in links}
    by_link = dict(sorted(by_link.items(), key=lambda item: np.mean([z.center for z in _zones(item[1])])))
    rows = [[link, "all", *_lean(mine)] for link, mine in by_link.items()]
    for link, kind in itertools.product(by_link, sorted(kinds)):
        if mine := [one for one in by_link[link] if one.kind == kind]:
            rows.append([link, kind, *_lean(mine)])
    return writer.Table(head, rows, lambda row: row[1] == "all", [name for name in head if name != "supports"])


def _zones(found: Sequence[robot.Lean]) -> list[compute.Zone]:
    return [zone for one in found for zone in one.outcome.zones]


def _lean(found: Sequence[robot.Lean]) -> list[str]:
    zones = _zones(found)
    return [
        _share([share > 0 for one in found for share in one.outcome.force]),
        _share([zone.center for zone in zones]),
        _share([held for one in found for held in one.outcome.held]),
        *(_ratio([zone[field] for zone in zones]) for field in (1, 2)),
        *(_components([hit for one in found for hit in getattr(one, which)]) for which in ("alone", "among")),
    ]


def _components(hits: Sequence[bool]) -> str:
    """A share of components of wrenches, with the interval of as many wrenches, as the six of one are not apart."""
    if not hits:
        return "none"
    count = len(hits) // 6
    low, high = wilson(round(float(np.mean(hits)) * count), count)
    return f"{100 * np.mean(hits):.1f} % of {count} ({100 * low:.1f} to {100 * high:.1f})"


def braces_table(found: dict[str, list[float]] | None = None) -> str:
    """The push that half of the robots stand, by way, the worst first; by direction also how many stand more and less
    than the same robots without skin."""
    found = brace.survive_all() if found is None else found
    bare = np.array(found["without skin"])
    away = np.arange(len(bare)) % brace.PUSHES < len(brace.POINTS_M)  # of the first direction
    head = ["force may act", "all pushes, Ns", "away from the arm", "more, less", "straight or toward it", "more, less"]
    rows = [[*head, "fall without a push"]]
    for way, stood in sorted(found.items(), key=lambda item: float(np.median(item[1]))):
        mine, cells = np.array(stood), []
        for some in (away | True, away, ~away):
            half = quantile(mine[some].tolist(), 0.5)
            cells += [f"{half.value:.0f} ({half.low:.0f} to {half.high:.0f})"]
            cells += [f"{(mine > bare)[some].sum()}, {(mine < bare)[some].sum()} of {some.sum()}"]
        rows.append([way, cells[0], *cells[2:], f"{(mine < 0).sum()} of {len(mine)}"])
    return writer.table_of(rows)


def draw(folder: Path) -> list[Path]:
    design = next(iter(DESIGNS))
    pitch = DESIGNS[design][0]
    with matplotlib.rc_context(style.SETTINGS):
        figure = style.new(3.0)
        for place, (kind, number) in zip(figure.subplots(1, len(DRAWN)), DRAWN, strict=True):
            found = compute.drawn(design, "elements", kind, number)
            for row, column in np.argwhere(found.cells):
                corner = (column - 0.5) * pitch, (row - 0.5) * pitch
                place.add_patch(Rectangle(corner, pitch, pitch, fc=style.PRESSED, ec=style.CARD, lw=0.8))
            touched = (found.there.force_n > 0).astype(float)
            place.contour(found.there.x_mm, found.there.y_mm, touched, [0.5], colors=style.VERMILLION, linewidths=1.2)
            outlines = [1e3 * one.corners_m[:, :2] for one in found.supports]
            for outline in outlines:
                place.add_patch(Polygon(outline, fc="none", ec=style.INK, lw=1.4))
            low, high = np.min(np.concatenate(outlines), axis=0), np.max(np.concatenate(outlines), axis=0)
            middle, half = (low + high) / 2, np.max(high - low) / 2 + pitch
            place.set(xlim=middle[0] + half * np.array([-1, 1]), ylim=middle[1] + half * np.array([1, -1]))
            place.set(aspect="equal", xticks=[], yticks=[])
            place.spines[["left", "bottom"]].set_visible(False)
            place.set_title(f"{kind}, {2 * half:.0f} mm wide", loc="left")
        return [style.save(figure, folder / "support-surfaces.svg")]
