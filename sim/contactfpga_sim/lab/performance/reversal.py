"""Tables of the reversal scan: from touch to wire, and what scanning by columns would save."""

from __future__ import annotations

import numpy as np

from contactfpga.shipped import examples
from contactfpga.skin import Skin
from contactfpga_sim.lab import latency, writer
from contactfpga_sim.model.scenes.families import FAMILIES, placements

FAST, FAST_64 = Skin.load(examples() / "fast.toml"), Skin.load(examples() / "fast-64x64.toml")

CONTACTS = {
    "16x16": (FAST, (3, 3)),
    "64x64": (FAST_64, (3, 3)),
    "64x64, palm": (FAST_64, (10, 10)),
    "64x64, any pattern": (FAST_64.replace(settle_us=2.9, project_us=8.2), (3, 3)),
}
"""The last one has the times that docs/settle.md gives for a sheet of which any switches may be pressed."""

TOUCHES = 196
"""Places of a contact, spread over the sheet; on 16x16 that is every place of 3x3 cells."""

SCENES = 400
"""Of each family."""


def latency_table() -> str:
    """Latency of the reversal scan, and of a raster scan of the reference sheet."""
    head = (
        "sheet", "contact", "touch to `contact` pin, worst", "touch to last byte, median / worst", "bound",
        "change to last byte, worst", "frames per second", "bytes",
    )  # fmt: skip
    rows = [latency_row(name, skin, cells) for name, (skin, cells) in CONTACTS.items()]
    return writer.table(head, [*rows, latency_row("16x16, raster, reference", Skin(), (3, 3))])


def latency_row(name: str, skin: Skin, cells: tuple[int, int]) -> str:
    """One line of :func:`latency_table`."""
    found = latency.measure(skin, cells, TOUCHES)
    last = found.touch_to_last_byte_us
    return writer.line(
        (
            name,
            f"{cells[0]}x{cells[1]}",
            f"{found.touch_to_contact_us.worst:.2f} us",
            f"**{last.median:.1f} / {last.worst:.1f} us**",
            _bound(skin, cells, found),
            f"{found.change_to_last_byte_us.worst:.1f} us",
            f"{found.frames_per_s:,.0f}",
            str(found.bytes),
        )
    )


def _bound(skin: Skin, cells: tuple[int, int], found: latency.Latency) -> str:
    """The projection, a row time per touched row, and the frame's bits; and how far the worst touch is above it."""
    if not skin.reads_rows:
        return ""
    derived = skin.derived
    slots = derived.project_clocks + cells[0] * derived.row_clocks
    bound = (slots + 10 * found.bytes * derived.bit_clocks) / derived.clocks_per_us
    return f"{bound:.1f} us, + {100 * (found.touch_to_last_byte_us.worst / bound - 1):.0f} %"


def sides_table() -> str:
    """Slots per frame of the built-in families, by rows only and by the side with fewer touched lines."""
    head = ("scenes", "touched rows, mean / most", "slots by rows", "slots by the shorter side", "saved")
    return writer.table(head, [sides_row(name) for name in FAMILIES])


def sides_row(name: str) -> str:
    """One line of :func:`sides_table`, on 16x16: a projection and a slot per row, or two projections and a slot per row
    or per column, whichever are fewer, where that is less."""
    frames = np.stack([scene.pressed(0.0, Skin()) for scene in placements(name, SCENES, 0, Skin())])
    rows, columns = frames.any(axis=2).sum(axis=1), frames.any(axis=1).sum(axis=1)
    one = 1 + rows
    both = np.minimum(one, 2 + np.minimum(rows, columns))
    saved = 1 - both.mean() / one.mean()
    counts = (
        f"{rows.mean():.1f} / {rows.max()}",
        f"{one.mean():.1f} / {one.max()}",
        f"{both.mean():.1f} / {both.max()}",
    )
    return writer.line((name, *counts, f"{100 * saved:.0f} %"))


def latency_sample() -> str:
    """The first row of :func:`latency_table`."""
    return latency_row("16x16", *CONTACTS["16x16"])


def sides_sample() -> str:
    """The first row of :func:`sides_table`."""
    return sides_row(next(iter(FAMILIES)))
