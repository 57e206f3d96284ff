"""Delay of frames to user code, which no test holds.

Methods alternate, so that other load affects all equally.
"""

from __future__ import annotations

import os

import numpy as np

from contactfpga_sim.lab import writer
from contactfpga_sim.lab.reader import latency, loop
from contactfpga_sim.lab.reader.feeder import PACES, Pace
from contactfpga_sim.lab.reader.latency import READERS, Found

ROUNDS = 1


def times(streams: list[Found]) -> tuple[float, float]:
    """Median and 99 % in ms over all rounds."""
    us = np.concatenate([one.us for one in streams])
    return float(np.percentile(us, 50)) / 1e3, float(np.percentile(us, 99)) / 1e3


def shown(streams: list[Found]) -> str:
    return " / ".join(f"{value:.3g}" for value in times(streams)) + " ms"


def rest_table(rounds: int = ROUNDS, paces: tuple[Pace, ...] = PACES) -> str:
    rows = [
        [
            "frames per second",
            "C program",
            *(f'`reader="{reader}"`' for reader in READERS),
            "their medians, as multiples of C",
        ]
    ]
    with latency.bare_program() as program:
        for pace in paces:
            found: dict[str, list[Found]] = {"c": [], **{reader: [] for reader in READERS}}
            for _ in range(rounds):
                found["c"].append(latency.bare(program, pace))
                for reader in READERS:
                    found[reader].append(latency.driver(reader, pace, busy=False))
            ratios = [times(found[reader])[0] / times(found["c"])[0] for reader in READERS]
            rows.append(
                [f"{pace.per_second:,}", *map(shown, found.values()), ", ".join(f"{one:.1f}" for one in ratios)]
            )
    return f"{writer.table_of(rows)}\n\n{conditions()}"


def busy_table(rounds: int = 1, paces: tuple[Pace, ...] = PACES) -> str:
    rows = [["frames per second", "call", *(f'`reader="{reader}"`' for reader in READERS), "calls per second"]]
    for pace in paces:
        for call in ("latest", "next") if pace is paces[0] else ("latest",):
            found: dict[str, list[Found]] = {reader: [] for reader in READERS}
            for _ in range(rounds):
                for reader in READERS:
                    found[reader].append(latency.driver(reader, pace, busy=True, call=call))
            calls = [f"{np.mean([one.calls for one in some]):.0f}" for some in found.values()]
            rows.append([f"{pace.per_second:,}", f"`{call}()`", *map(shown, found.values()), ", ".join(calls)])
    return writer.table_of(rows)


def loop_table() -> str:
    rows = [["beside it", "switch interval", "reader", "deadlines missed", "stops on silence that was none"]]
    for busy, switch_s in ((False, 0.005), (True, 0.005), (True, 0.0005)):
        for reader in READERS:
            found = loop.measured(reader, busy, switch_s)
            beside = "a thread that computes" if busy else "nothing"
            missed = f"{found.missed:,} of {found.deadlines:,}"
            rows.append([beside, f"{switch_s * 1e3:g} ms", f"`{reader}`", missed, str(found.silent)])
    return writer.table_of(rows)


def conditions() -> str:
    load = os.getloadavg()[0]
    return f"Measured with {os.cpu_count()} cores and a load of {load:.1f} at the end of this table."
