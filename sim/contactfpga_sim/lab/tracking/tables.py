"""Speed of the tracker; tables and picture of docs/tracking.md."""

from __future__ import annotations

import csv
import time
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import NamedTuple

from contactfpga import picture_style as style
from contactfpga.driver.conversation import Conversation, frames_in
from contactfpga.tracking.tracker import Tracker
from contactfpga.zones.zone import Zones
from contactfpga_sim.lab import knobs, writer
from contactfpga_sim.lab.knobs import Knob, Sweep
from contactfpga_sim.lab.reader import reflex
from contactfpga_sim.lab.reader.feeder import frame, greeting
from contactfpga_sim.lab.tracking import breaks, scenes, scores

FRAMES = 8192


class FrameRates(NamedTuple):
    """Frames per second of processor time."""

    decoded: float
    """Rate from bytes to zones with places."""
    tracked: float
    """Rate from zones to tracks."""

    @property
    def ratio(self) -> float:
        """Tracking time over decoding time."""
        return self.decoded / self.tracked


def measure(contacts: int, frames: int = FRAMES) -> FrameRates:
    """Rates with moving contacts, the best of rounds."""
    chunks = [frame(number, 1, contacts) for number in range(frames)]
    rounds = [_round(chunks) for _ in range(4)]
    return FrameRates(*(max(found) for found in zip(*rounds)))


def _round(chunks: list[bytes]) -> FrameRates:
    host = Conversation("bytes")
    host.receive(greeting(), 0.0)
    arrived: list[Zones] = []

    def decode() -> None:
        for chunk in chunks:
            for zones in frames_in(host.receive(chunk, 0.0)):
                zones[0]  # its places, which are computed when they are asked for
                arrived.append(zones)

    tracker = Tracker()
    decoded = _rate(decode, len(chunks))
    tracked = _rate(lambda: [tracker.update(zones) for zones in arrived], len(arrived))
    assert len(arrived) == len(chunks)
    return FrameRates(decoded, tracked)


def _rate(work: Callable[[], object], count: int) -> float:
    started = time.process_time()
    work()
    return count / (time.process_time() - started)


MEAN = "mean of all"
RECORDINGS = Path("../shared/data")
LOOKS = {
    "`Tracker`": (style.BLUE, "solid"),
    "nearest zone": (style.VERMILLION, style.DASHES[1]),
    "constant velocity": (style.GREEN, style.DASHES[2]),
    "Norfair": (style.ORANGE, style.DASHES[3]),
}


def scores_table() -> writer.Table:
    found = scores.all_scenes()
    heads = tuple(f"{name}: IDF1, %" for name in scores.TRACKERS)
    head = ("scenes", "frames per second", *heads, "`Tracker`: MOTA, %", "id switches per 1,000 frames")
    rows = [_scores(family, rate, one) for (family, rate), one in found.items()]
    for rate in scores.RATES_HZ:
        each = [one for (_, other), one in found.items() if other == rate]
        means = (f"**{sum(100 * one[name].idf1 for one in each) / len(each):.1f}**" for name in scores.TRACKERS)
        rows.append((MEAN, f"{rate:,g}", *means, "", ""))
    return writer.Table(head, rows, lambda row: row[0] == MEAN, head[:-2])


def _scores(family: str, rate: float, found: scores.Scores) -> tuple[str, ...]:
    each = (f"{100 * one.idf1:.1f} ± {100 * one.half:.1f}" for one in found.values())
    ours = found["`Tracker`"]
    return f"`{family}`", f"{rate:,g}", *each, f"{100 * ours.mota:.1f}", f"{ours.switches_per_1000:.1f}"


def ahead_table() -> writer.Table:
    names = [name for name in scores.TRACKERS if name != "`Tracker`"]
    rows = []
    for (family, rate), found in scores.all_scenes().items():
        gained = [scores.ahead(found["`Tracker`"], found[name]) for name in names]
        if rate in scores.JUDGED_RATES:
            rows.append((f"`{family}`", f"{rate:,g}", *(f"{100 * one:.1f} ± {100 * half:.1f}" for one, half in gained)))
    head = ("scenes", "frames per second", *(f"ahead of {name}, %" for name in names))
    return writer.Table(head, rows, lambda row: row[1] == f"{scores.JUDGED_RATES[0]:g}")


def recorded_table() -> writer.Table:
    rows = []
    for path in sorted(RECORDINGS.glob("*.npz")):
        for every in scores.EVERY:
            found = scores.of_recording(path, every).values()
            taken = "all" if every == 1 else f"one of {every}"
            rows.append((path.name.partition(".")[0], taken, *(f"{100 * one.idf1:.1f}" for one in found)))
    head = ("recording", "frames taken", *(f"{name}: IDF1, %" for name in scores.TRACKERS))
    return writer.Table(head, rows, lambda row: row[1] == "all")


BREAKS = ("knob", "method", "right in 95 % up to", "right there", "right at the next", "closed form", "what helps")


def breaks_table() -> writer.Table:
    """The page shows the first method of each knob."""
    swept = knobs.sweeps(breaks.__name__)
    rows = [row for name, methods in swept.items() for row in break_rows(breaks.KNOBS[name], methods)]
    return writer.Table(BREAKS, rows, lambda row: row[0], (BREAKS[0], BREAKS[2], BREAKS[6]))


def break_rows(knob: Knob, found: Mapping[str, Sweep]) -> Iterator[tuple[str, ...]]:
    """A knob's lines; common cells are only in the first."""
    for number, (method, sweep) in enumerate(found.items()):
        held = len(sweep.values) if sweep.broken is None else sweep.broken
        until = f"**{sweep.values[held - 1]:g}**" if held else "nowhere"
        until += ", all there are" if sweep.broken is None else ""
        there = sweep.outcomes[held - 1].rate if held else ""
        after = "" if sweep.broken is None else f"{sweep.breaks_at:g}: {sweep.outcomes[sweep.broken].rate}"
        closed = f"{knob.closed[method]:g}" if method in knob.closed else ""
        first = (f"{knob.title}: {knob.axis}", knob.helps) if number == 0 else ("", "")
        yield first[0], method, until, there, after, closed, first[1]


def speed_table() -> str:
    rows = [("contacts", "tracked per second", "decoded per second", "tracking takes, in times of decoding")]
    for contacts in (1, 2):
        found = measure(contacts)
        rows.append((str(contacts), f"{found.tracked:,.0f}", f"{found.decoded:,.0f}", f"{found.ratio:.2f}"))
    return writer.table_of(rows)


def reflex_table() -> str:
    return writer.table_of([reflex.HEAD, reflex.measured().cells])


SCORES = Path("docs/tables/tracking-scores.csv")


def draw(folder: Path) -> Path:
    import matplotlib

    with SCORES.open(newline="", encoding="utf-8") as file:
        rows = [row for row in csv.DictReader(file) if not row["scenes"].startswith("mean")]
    with matplotlib.rc_context(style.SETTINGS):
        figure = style.new(5.0)
        panels = figure.subplots(2, len(scenes.FAMILIES) // 2, sharex=True, sharey=True)
        for axes, family in zip(panels.flat, scenes.FAMILIES):
            some = [row for row in rows if row["scenes"] == f"`{family}`"]
            rates = [float(row["frames per second"].replace(",", "")) for row in some]
            for tracker, (color, dashes) in LOOKS.items():
                values = [float(row[f"{tracker}: IDF1, %"].split()[0]) for row in some]
                name = tracker.replace("`", "")
                axes.plot(rates, values, color=color, ls=dashes, marker="o", ms=4, label=name)
            axes.set_title(family, loc="left")
            axes.set(xscale="log", ylim=(0, 105))
            axes.set_xticks(rates, [f"{rate / 1000:g}k" if rate >= 1000 else f"{rate:g}" for rate in rates])
            axes.minorticks_off()
            axes.grid(True)
            axes.tick_params(labelbottom=True)
        for axes in panels[:, 0]:
            axes.set_ylabel("time with one id (IDF1), %")
        figure.legend(*panels[0, 0].get_legend_handles_labels(), loc="outside upper center", ncols=len(LOOKS))
        figure.supxlabel("frames per second", fontsize=style.NORMAL)
        return style.save(figure, folder / "tracking.svg")
