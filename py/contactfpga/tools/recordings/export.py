"""Writes a recording as one long table for analysis programs: Parquet, NPZ, CSV.

The table has a row for each zone of each frame, and one for a frame without zones.
"""

from __future__ import annotations

import csv
import dataclasses
import json
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import Any

import numpy as np

from contactfpga.errors import ContactFPGAError, MissingExtra
from contactfpga.inputs.files import reason_of, replaced
from contactfpga.robot.ros.convert import flag_bits
from contactfpga.tools.recordings.recording import Recording
from contactfpga.tracking.tracker import Tracker
from contactfpga.zones.zone import Zones

COLUMNS = {
    "t_s": (np.float64, "seconds since the recording began, on the host's clock; without arrivals on the board's"),
    "link": (np.str_, "whose board it is"),
    "frame": (np.int64, "frames of this link before this one"),
    "time_us": (np.int64, "when the frame was scanned, in us since its board's power-up"),
    "zone": (np.int32, "zones of this frame before this one; -1: nothing touches"),
    "track": (np.int64, "id of the contact, which stays from frame to frame; -1: none"),
    "area_mm2": (np.float64, "area of the zone's cells in mm2"),
    "x_mm": (np.float64, "barycenter along the columns in mm, on the sheet laid flat"),
    "y_mm": (np.float64, "barycenter along the rows in mm"),
    "area_cells": (np.int32, "pressed cells of the zone"),
    "ghost": (np.bool_, "other pressed switches may have made it"),
    "winding": (np.str_, "ring or wound: it leads around a sheet whose ends meet, and has no x; else empty"),
    "flags": (np.uint8, "of the frame: the bits of contactfpga_msgs/Zones"),
    "left": (np.int16, "first column of the zone; beyond right, it goes over the seam; -1: the board sends no extents"),
    "right": (np.int16, "last column of the zone, or -1"),
    "top": (np.int16, "first row of the zone, or -1"),
    "bottom": (np.int16, "last row of the zone, or -1"),
}
"""Type and meaning of each column."""

ROWS = 1 << 16

_NO_BOX = (-1, -1, -1, -1)
_NOTHING = (-1, -1, np.nan, np.nan, np.nan, 0, False, ""), _NO_BOX
Piece = dict[str, np.ndarray]


def pieces(recording: Recording, rows: int = ROWS) -> Iterator[Piece]:
    """The table in at least one piece of about ``rows`` rows: an array for each of :data:`COLUMNS`."""
    trackers: dict[str, Tracker] = {}
    counts: dict[str, int] = {}
    found: list[tuple[object, ...]] = []
    for t_s, link, zones in recording.frames():
        tracker = trackers.setdefault(link, Tracker())
        number = counts[link] = counts.get(link, -1) + 1
        flags = flag_bits(zones.flags)
        head = t_s, link, number, zones.time_us
        found += [(*head, *values, flags, *box) for values, box in _zones(zones, tracker)]
        if len(found) >= rows:
            yield _arrays(found)
            found = []
    yield _arrays(found)


def _zones(zones: Zones, tracker: Tracker) -> list[tuple[tuple[object, ...], tuple[int, ...]]]:
    ids = {id(track.zone): track.id for track in tracker.update(zones).active if not track.held}
    return [
        (
            (
                number,
                ids.get(id(zone), -1),
                zone.area_mm2,
                np.nan if zone.x_mm is None else zone.x_mm,
                np.nan if zone.y_mm is None else zone.y_mm,
                zone.area_cells,
                zone.ghost,
                zone.winding,
            ),
            zone.box or _NO_BOX,
        )
        for number, zone in enumerate(zones)
    ] or [_NOTHING]


def _arrays(rows: list[tuple[object, ...]]) -> Piece:
    columns = zip(*rows, strict=True) if rows else [()] * len(COLUMNS)
    return {name: np.array(values, kind) for (name, (kind, _)), values in zip(COLUMNS.items(), columns, strict=True)}


def facts(recording: Recording) -> str:
    """Metadata of the table as JSON: its beginning, and each link's sheet and Skin."""
    links = {
        link: {
            "name": hello.name,
            "fingerprint": hello.fingerprint.hex(),
            "sheet": dataclasses.asdict(hello.sheet),
            "skin": None if (skin := recording.skins[link]) is None else skin.to_toml(),
        }
        for link, hello in recording.links.items()
    }
    return json.dumps({"start_s": recording.start_s, "duration_s": recording.duration_s, "links": links})


KEY = "contactfpga"
"""Key of the metadata in Parquet and NPZ."""


def export(recording: Recording, path: str | Path) -> int:
    """Write the table to a file named ``.parquet``, ``.npz`` or ``.csv``, which appears once complete; returns the
    number of rows.

    Raises :class:`ContactFPGAError`; :class:`~contactfpga.MissingExtra` without pyarrow, which Parquet needs.
    """
    target = Path(path)
    write = _WRITERS.get(target.suffix.lower())
    if write is None:
        raise ContactFPGAError(f"{path}: its name ends in {target.suffix!r}; take one of: {', '.join(_WRITERS)}")
    rows = 0

    def counted() -> Iterator[Piece]:
        nonlocal rows
        for piece in pieces(recording):
            rows += len(piece["t_s"])
            yield piece

    try:
        with replaced(target) as new:
            write(new, counted(), facts(recording))
    except OSError as error:
        raise ContactFPGAError(f"{path} cannot be written: {error.strerror or reason_of(error)}") from None
    return rows


def _parquet(path: Path, parts: Iterable[Piece], about: str) -> None:
    try:
        import pyarrow
        from pyarrow import parquet
    except ModuleNotFoundError as error:
        raise MissingExtra(f"Parquet ({error})", "analysis") from None
    names = pyarrow.dictionary(pyarrow.int16(), pyarrow.string())
    kinds = {name: names if kind is np.str_ else pyarrow.from_numpy_dtype(kind) for name, (kind, _) in COLUMNS.items()}
    fields = [pyarrow.field(name, kind, metadata={"meaning": COLUMNS[name][1]}) for name, kind in kinds.items()]
    schema = pyarrow.schema(fields, metadata={KEY: about})
    with parquet.ParquetWriter(path, schema, compression="zstd") as writer:
        for piece in parts:
            columns = [pyarrow.array(piece[name]).cast(kind) for name, kind in kinds.items()]
            writer.write_table(pyarrow.Table.from_arrays(columns, schema=schema))


def _npz(path: Path, parts: Iterable[Piece], about: str) -> None:
    every = list(parts)
    columns: dict[str, Any] = {name: np.concatenate([piece[name] for piece in every]) for name in COLUMNS}
    columns[KEY] = np.array(about)
    with open(path, "wb") as file:  # which gets no second suffix
        np.savez_compressed(file, **columns)


def _csv(path: Path, parts: Iterable[Piece], about: str) -> None:
    with open(path, "w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(COLUMNS)
        for piece in parts:
            writer.writerows(zip(*(piece[name].tolist() for name in COLUMNS), strict=True))


_WRITERS: dict[str, Callable[[Path, Iterable[Piece], str], None]] = {".parquet": _parquet, ".npz": _npz, ".csv": _csv}
