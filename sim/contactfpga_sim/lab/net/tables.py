"""Tables and picture of docs/net.md."""

from __future__ import annotations

import csv
import functools
from pathlib import Path
from typing import Any

from contactfpga import picture_style as style
from contactfpga.robot.net.message import HEAD_BYTES
from contactfpga_sim.lab import writer
from contactfpga_sim.lab.net import load

BATCHES_MS = (0.0, 2.0, 10.0)
LINKS = (1, 4, 16, 64)
GROWTH_MS = 10.0
LINE_BYTES = 54 + 12
"""Approximate overhead of a message."""
GIGABIT = 1e9 / 8


@functools.cache
def measured(links: int, batch_ms: float, *, full: bool) -> load.NetworkRun:
    """One measurement per run of this program; the cache needs ``full`` in the call."""
    return load.measure(links, batch_ms / 1000, full)


def batch_table() -> str:
    head = ("batch", "messages per second", "latency p50 / p99", "of a bare pair", "ratio p50 / p99")
    rows: list[tuple[str, ...]] = [(*head, "CPU, all ends")]
    for batch_ms in BATCHES_MS:
        found = measured(1, batch_ms, full=False)
        cells = (f"{batch_ms:g} ms", f"{found.messages:,.0f}", _ms(found.latency), _ms(found.bare), _ratio(found))
        rows.append((*cells, _percent(sum(found.cpu.values()))))
    return writer.table_of(rows)


def links_table() -> writer.Table:
    head = ("links", "frames per second", "of those sent", "lost", "CPU per link: publisher", "router", "reader")
    rows = []
    for links, full in (*((count, False) for count in LINKS), (LINKS[-1], True)):
        found = measured(links, GROWTH_MS, full=full)
        name = f"{links}" + (f", and one of {load.FULL_HZ:,.0f} Hz" if full else "")
        cpu = (_percent(used / found.links) for used in _ends(found))
        rates = (f"{found.frames:,.0f}", f"{100 * found.share:.1f} %", f"{found.lost}")
        rows.append((name, *rates, *cpu, _ms(found.latency), _ratio(found)))
    heads = (*head, "latency p50 / p99", "in times of a bare pair's")
    return writer.Table(heads, rows, lambda row: row[0].isdecimal(), ("links", "of those sent", "latency p50 / p99"))


def _ends(found: load.NetworkRun) -> tuple[float, float, float]:
    cpu = found.cpu
    return cpu["publishers"], cpu["router"], cpu["reader"] + cpu["other reader"]


def thousand_table() -> str:
    found = measured(LINKS[-1], GROWTH_MS, full=False)
    publisher, router, reader = (used / found.links for used in _ends(found))
    frame = len(load.frames(1)[0])
    messages = 1000 / GROWTH_MS
    per_link = load.RATE_HZ * frame + messages * (HEAD_BYTES + LINE_BYTES)
    total = 1000 * per_link
    rows = [
        ("of 1,000 links of 1 kHz", "takes", "so"),
        ("bytes of frames", f"{load.RATE_HZ * frame / 1e3:,.0f} kB/s each", f"{frame} bytes for one zone"),
        ("bytes on the network", f"{total / 1e6:,.0f} MB/s", f"{100 * total / GIGABIT:.0f} % of a gigabit link"),
        ("messages", f"{1000 * messages:,.0f} per second", f"batches of {GROWTH_MS:g} ms"),
        ("routers", f"{1000 * router:.1f} cores", "spread over the machines: a router for each, or for a few"),
        ("publishers", f"{1000 * publisher:.1f} cores", "on the machines with the boards"),
        (
            "readers",
            f"{1000 * reader:.1f} cores",
            "**break first**: one Python process reads at most "
            f"{1 / reader:,.0f} links; split them over processes, or raise the batch",
        ),
    ]
    return writer.table_of(rows)


def _ratio(found: load.NetworkRun) -> str:
    return " / ".join(f"{one / bare:.1f}" for one, bare in zip(found.latency, found.bare, strict=True))


def _percent(share: float) -> str:
    return f"{100 * share:.1f} %"


def _ms(latency: tuple[float, float]) -> str:
    return " / ".join(f"{1000 * one:.1f}" for one in latency) + " ms"


WHOLE = Path("docs/tables/net-links.csv")
ENDS = {"publisher": style.BLUE, "router": style.VERMILLION, "reader": style.GREEN}
SHARES = {"half arrive (p50)": style.BLUE, "99 % arrive (p99)": style.VERMILLION}


def draw(folder: Path) -> Path:
    import matplotlib

    with WHOLE.open(newline="", encoding="utf-8") as file:
        rows = [row for row in csv.reader(file) if row[0].isdecimal()]
    links = [int(row[0]) for row in rows]
    with matplotlib.rc_context(style.SETTINGS):
        figure = style.new(3.4)
        cpu, latency = figure.subplots(1, 2)
        for column, (name, color) in enumerate(ENDS.items(), 4):
            values = [float(row[column].removesuffix(" %")) for row in rows]
            _line(cpu, links, values, name, color)
        for place, (name, color) in enumerate(SHARES.items()):
            values = [_pair(row[7])[place] for row in rows]
            _line(latency, links, values, name, color)
            bare = [value / _pair(row[8])[place] for value, row in zip(values, rows, strict=True)]
            _line(latency, links, bare, f"{name[-4:-1]} of a bare pair", color, ls=style.DASHES[1])
        for axes, label, ticks in (
            (cpu, "processor time of each link,\n% of a core", (0.1, 0.3, 1, 3, 10, 30)),
            (latency, "latency, ms", (0.1, 0.3, 1, 3, 10, 30, 100, 300, 1000)),
        ):
            axes.set(xscale="log", yscale="log", xlabel="links of 1 kHz, batches of 10 ms", ylabel=label)
            axes.set_xticks(links, map(str, links))
            axes.set_yticks(ticks, map("{:,g}".format, ticks))
            axes.set(xlim=(links[0] / 1.3, links[-1] * 1.3), ylim=(0.1, 3 * ticks[-1]))
            axes.minorticks_off()
            axes.grid(True)
            axes.legend(handlelength=3)
        return style.save(figure, folder / "net.svg")


def _pair(cell: str) -> list[float]:
    return [float(one) for one in cell.removesuffix(" ms").split(" / ")]


def _line(axes: Any, links: list[int], values: list[float], name: str, color: str, **how: Any) -> None:
    axes.plot(links, values, marker="o", ms=4, color=color, label=name, **how)
