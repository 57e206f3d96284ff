"""The table of docs/clock.md."""

from __future__ import annotations

from collections.abc import Iterable

from contactfpga_sim.lab import writer
from contactfpga_sim.lab.clock.compute import PATHS, accuracy

HEAD = (
    "way to the host",
    "arrival is late by",
    "error, median",
    "99 %",
    "`host_sigma_s`",
    "error within 2 sigma",
)


def accuracy_table(names: Iterable[str] = PATHS) -> str:
    """Over simulated ways."""
    rows: list[tuple[str, ...]] = [HEAD]
    for path in (PATHS[name] for name in names):
        found = accuracy(path)
        times = (found.late_s, found.error_s, found.worst_s, found.sigma_s)
        rows.append((path.title, *(f"{1e6 * time_s:,.0f} µs" for time_s in times), f"{100 * found.within:.0f} %"))
    return writer.table_of(rows)


def slow_sample() -> str:
    """One row of :func:`accuracy_table`."""
    return accuracy_table(("slow",)).splitlines()[-1]
