"""Clocks of the labeller's last record from a frame's last row, for touches and for shapes that break labellers."""

from __future__ import annotations

import numpy as np

from contactfpga.choices.labellers import LABELLERS, Labeller, LabellerName
from contactfpga.skin import Skin
from contactfpga_sim.lab import writer
from contactfpga_sim.model.golden import volume
from contactfpga_sim.model.scenes.cells import to_words
from contactfpga_sim.model.scenes.families import FAMILIES, placements
from contactfpga_sim.model.scenes.scene import CONTACTS
from contactfpga_sim.model.scenes.shapes import variants
from contactfpga_sim.verify.cosim.bench_labeller import LabelBench

EXACT = tuple(labeller for labeller in LABELLERS.values() if labeller.exact)

SHEET = Skin(settle_us=15.0)

TOUCHES = 400
"""Random scenes of each family."""

SEED = 20


def labeller_table() -> str:
    place, worst = "touches at every place: median / 99 % / worst", "shapes that break labellers, worst"
    lines = []
    places = every_place(touches(SHEET))
    for labeller in EXACT:
        for connectivity in (8, 4):
            lines.append(labeller_row(SHEET.replace(labeller=labeller, connectivity=connectivity), places))
    return writer.table(("labeller", "connectivity", place, worst, "bound"), lines)


def labeller_row(skin: Skin, places: tuple[np.ndarray, np.ndarray]) -> str:
    worst = worst_last_record_clocks(skin)
    found = f"{spread(*places, skin.connectivity, skin.labeller)} clocks"
    most = str(bound(skin.columns, skin.connectivity, skin.labeller))
    return writer.line((f"`{skin.labeller}`", str(skin.connectivity), found, f"{worst} clocks", most))


def bound(columns: int, connectivity: int, labeller: LabellerName | Labeller) -> int:
    """Most clocks from a frame's last row to its last record: the end mark is a clock later."""
    skin = Skin(rows=16, columns=columns, connectivity=connectivity, labeller=labeller, settle_us=15.0)
    return skin.derived.label_clocks - 1


def worst_last_record_clocks(skin: Skin) -> int:
    """Worst clocks over breaking shapes, in compiled gateware."""
    with LabelBench(skin) as bench:
        frames = np.stack([cells for _, cells in variants(skin.rows, skin.columns)])
        return int(bench.run(frames).last_record_clocks.max())


def touches(skin: Skin) -> np.ndarray:
    """(n, R, C) bool: built-in contacts, and scenes of every family."""
    scenes = [make(skin) for make in CONTACTS.values()]
    for family in FAMILIES:
        scenes += placements(family, TOUCHES, SEED, skin)
    return np.stack([scene.pressed(0.0, skin) for scene in scenes])


def last_rows(frames: np.ndarray) -> np.ndarray:
    """(m, 2) uint64 words: the last two rows if the sheet ends after any row of (n, R, C) bool frames, or one row
    later, if a cell is pressed in them. Every zone there leaves with the last row."""
    words = np.pad(to_words(frames), ((0, 0), (1, 1)))
    pairs = np.stack([words[:, :-1], words[:, 1:]], axis=-1).reshape(-1, 2)
    return pairs[pairs.any(axis=1)]


def every_place(frames: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The last two rows at every whole-cell offset of frames, also partly off the sheet: (k, 2, C) bool, and counts."""
    columns = frames.shape[2]
    sheet = np.uint64((1 << columns) - 1)
    pairs = last_rows(frames)
    offsets = np.arange(columns, dtype=np.uint64)
    shifted = [pairs << offset & sheet for offset in offsets] + [pairs >> offset for offset in offsets[1:]]
    return counted(np.concatenate(shifted), columns)


def counted(pairs: np.ndarray, columns: int) -> tuple[np.ndarray, np.ndarray]:
    """Distinct nonempty words as (k, 2, C) bool, and counts."""
    # One number a pair: unique() by number is many times faster than by rows.
    pairs = np.ascontiguousarray(pairs[pairs.any(axis=1)])
    different, count = np.unique(pairs.view([("before", "<u8"), ("last", "<u8")]), return_counts=True)
    bits = np.arange(columns, dtype=np.uint64)
    return (different.view("<u8").reshape(-1, 2, 1) >> bits & np.uint64(1)).astype(bool), count


def spread(rows: np.ndarray, count: np.ndarray, connectivity: int, labeller: LabellerName | Labeller) -> str:
    """Median, 99 % and worst clocks to the last record, by the golden model, over (k, 2, C) rows with these counts."""
    clocks = volume.last_record_clocks(rows, connectivity, labeller)
    order = np.argsort(clocks, kind="stable")
    reached = np.cumsum(count[order])
    median, most = (clocks[order[np.searchsorted(reached, share * reached[-1])]] for share in (0.5, 0.99))
    return f"{median} / {most} / {clocks.max()}"


def labeller_sample() -> str:
    return labeller_row(SHEET, every_place(touches(SHEET)))
