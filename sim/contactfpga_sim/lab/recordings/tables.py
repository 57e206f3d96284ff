"""Tables of docs/recordings.md."""

from __future__ import annotations

import atexit
import functools
import shutil
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

from contactfpga_sim.lab import writer
from contactfpga_sim.lab.recordings import compute

SECONDS = {10_000: 3.0, 1_000: 5.0}
KILLS = 8


@functools.cache
def stream(rate: int) -> Path:
    """Bytes of a board of about this rate."""
    path = Path(tempfile.mkdtemp(prefix="contactfpga-page-")) / "stream.bin"
    atexit.register(shutil.rmtree, path.parent)
    compute.bytes_of(compute.SKINS[rate], SECONDS[rate], path)
    return path


def sizes_table() -> str:
    """Sizes of recordings, on all machines the same but for chunk ends, and speeds of this machine."""
    head = ("frames/s", "messages", "bytes per frame", "MB an hour", "frames per CPU second")
    rows = [head]
    with compute.folder() as place:
        for rate in compute.SKINS:
            for bare in (False, True):
                found = compute.cost(stream(rate), SECONDS[rate], place / f"{rate}_{bare}.mcap", bare)
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


def loss_table() -> str:
    with compute.folder() as place:
        found = [compute.loss(stream(10_000), 0.5 + 0.237 * kill, place / str(kill)) for kill in range(KILLS)]
    rows = [
        ("kill -9", "bytes that had come", "lost, bytes", "lost, s"),
        ("median of " + str(KILLS), *_cells(found, lambda values: sorted(values)[len(values) // 2])),
        ("worst", *_cells(found, max)),
    ]
    return writer.table_of(rows)


def _cells(found: list[compute.Loss], of: Callable[[list[Any]], Any]) -> tuple[str, str, str]:
    return (
        f"{of([one.came for one in found]):,}",
        f"{of([one.lost for one in found]):,}",
        f"{of([one.lost_s for one in found]):.3f}",
    )
