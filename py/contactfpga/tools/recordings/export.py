"""Writes the table of a recording for programs that analyze it: Parquet, NPZ, CSV."""

from __future__ import annotations

import csv
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import Any

import numpy as np

from contactfpga.errors import ContactFPGAError, MissingExtra
from contactfpga.inputs.files import replaced, told
from contactfpga.tools.recordings import table
from contactfpga.tools.recordings.recording import Recording
from contactfpga.tools.recordings.table import COLUMNS, Piece

KEY = "contactfpga"
"""Under which the facts stand in Parquet and NPZ."""


def export(recording: Recording, path: str | Path) -> int:
    """Write the table to a file whose name ends in ``.parquet``, ``.npz`` or ``.csv``; returns the number of its rows.

    The file is there once it is whole. Raises :class:`ContactFPGAError`; :class:`~contactfpga.MissingExtra` where
    pyarrow is missing, which Parquet needs.
    """
    target = Path(path)
    write = _WRITERS.get(target.suffix.lower())
    if write is None:
        raise ContactFPGAError(f"{path}: its name ends in {target.suffix!r}; take one of: {', '.join(_WRITERS)}")
    counted = _Counted(table.pieces(recording))
    try:
        with replaced(target) as new:
            write(new, counted, table.facts(recording))
    except OSError as error:
        raise ContactFPGAError(f"{path} cannot be written: {error.strerror or told(error)}") from None
    return counted.rows


class _Counted:
    """Pieces, and how many rows they had."""

    def __init__(self, pieces: Iterable[Piece]):
        self._pieces = pieces
        self.rows = 0

    def __iter__(self) -> Iterator[Piece]:
        for piece in self._pieces:
            self.rows += len(piece["t_s"])
            yield piece


def _parquet(path: Path, pieces: Iterable[Piece], facts: str) -> None:
    try:
        import pyarrow
        from pyarrow import parquet
    except ModuleNotFoundError as error:
        raise MissingExtra(f"Parquet ({error})", "analysis") from None
    names = pyarrow.dictionary(pyarrow.int16(), pyarrow.string())
    kinds = {name: names if kind is np.str_ else pyarrow.from_numpy_dtype(kind) for name, (kind, _) in COLUMNS.items()}
    fields = [pyarrow.field(name, kind, metadata={"meaning": COLUMNS[name][1]}) for name, kind in kinds.items()]
    schema = pyarrow.schema(fields, metadata={KEY: facts})
    with parquet.ParquetWriter(path, schema, compression="zstd") as writer:
        for piece in pieces:
            columns = [pyarrow.array(piece[name]).cast(kind) for name, kind in kinds.items()]
            writer.write_table(pyarrow.Table.from_arrays(columns, schema=schema))


def _npz(path: Path, pieces: Iterable[Piece], facts: str) -> None:
    every = list(pieces)
    columns: dict[str, Any] = {name: np.concatenate([piece[name] for piece in every]) for name in COLUMNS}
    columns[KEY] = np.array(facts)
    with open(path, "wb") as file:  # which gets no second suffix
        np.savez_compressed(file, **columns)


def _csv(path: Path, pieces: Iterable[Piece], facts: str) -> None:
    with open(path, "w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(COLUMNS)
        for piece in pieces:
            writer.writerows(zip(*(piece[name].tolist() for name in COLUMNS), strict=True))


_WRITERS: dict[str, Callable[[Path, Iterable[Piece], str], None]] = {".parquet": _parquet, ".npz": _npz, ".csv": _csv}
