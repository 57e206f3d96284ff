"""The figures of docs/recordings.md.

python -m contactfpga_sim.pages.record_page docs/recordings.md
"""

from __future__ import annotations

import sys

from contactfpga_sim.pages import writer
from contactfpga_sim.studies import recording

SECONDS = {10_000: 4.0, 1_000: 20.0}
"""Of device time, by frames per second."""
KILLS = 8


def sizes_table() -> str:
    """Sizes are the same on each machine, but for how often a chunk ends; speeds are this one's."""
    head = ("frames/s", "messages", "bytes per frame", "MB an hour", "frames per CPU second")
    rows = [head]
    with recording.folder() as place:
        for rate, skin in recording.SKINS.items():
            source = place / f"{rate}.bin"
            recording.bytes_of(skin, SECONDS[rate], source)
            for bare in (False, True):
                found = recording.cost(source, SECONDS[rate], place / f"{rate}_{bare}.mcap", bare)
                rows.append(
                    (
                        f"{found.frames_per_s:,.0f}",
                        "no, `--bytes-only`" if bare else "yes",
                        f"{found.bytes_per_frame:.1f}",
                        f"{found.mb_an_hour:,.0f}",
                        f"{found.frames_per_cpu_s:,.0f}",
                    )
                )
    return writer.table_of(rows)


def reading_table() -> str:
    """On the machine that runs this."""
    with recording.folder() as place:
        recording.bytes_of(recording.SKINS[10_000], 2.0, place / "x.bin")
        recording.cost(place / "x.bin", 2.0, place / "x.mcap", False)
        found = recording.reading(place / "x.mcap", place / "x.parquet")
    rows = [
        ("reading", "per CPU second"),
        ("`Recording.frames()`", f"{found.frames:,.0f} frames"),
        (
            "`contactfpga export`, with tracks",
            f"{found.rows:,.0f} rows, {found.parquet_bytes:.1f} bytes each in Parquet",
        ),
    ]
    return writer.table_of(rows)


def loss_table() -> str:
    """Killed at several moments."""
    with recording.folder() as place:
        recording.bytes_of(recording.SKINS[10_000], 6.0, place / "x.bin")
        found = [recording.loss(place / "x.bin", 0.5 + 0.237 * kill, place / str(kill)) for kill in range(KILLS)]
    rows = [
        ("kill -9", "bytes that had come", "lost, bytes", "lost, s"),
        ("median of " + str(KILLS), *_cells(found, lambda values: sorted(values)[len(values) // 2])),
        ("worst", *_cells(found, max)),
    ]
    return writer.table_of(rows)


def _cells(found: list[recording.Loss], of) -> tuple[str, str, str]:  # type: ignore[no-untyped-def]
    return (
        f"{of([one.came for one in found]):,}",
        f"{of([one.lost for one in found]):,}",
        f"{of([one.lost_s for one in found]):.3f}",
    )


TABLES: writer.Tables = {"sizes": sizes_table, "reading": reading_table, "loss": loss_table}

if __name__ == "__main__":
    sys.exit(writer.main(TABLES))
