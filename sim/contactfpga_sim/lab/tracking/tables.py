"""How many frames a tracker takes on this machine; the tables and the picture of docs/tracking.md."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import NamedTuple

from contactfpga import picture_style as style
from contactfpga.driver.conversation import Arrival, Conversation
from contactfpga.tracking.tracker import Tracker
from contactfpga.zones.zone import Zones
from contactfpga_sim.lab import writer
from contactfpga_sim.lab.failures import tables as failures_tables
from contactfpga_sim.lab.performance.scans import RECORDINGS
from contactfpga_sim.lab.speed.driver import frame, greeting
from contactfpga_sim.lab.tracking import breaks, reflex, scenes, scores

FRAMES = 8192


class FrameRates(NamedTuple):
    """Frames per second of processor time."""

    decoded: float
    """From bytes to zones with their places, frame by frame."""
    tracked: float
    """From zones to tracks."""

    @property
    def ratio(self) -> float:
        """Time that tracking takes, in times of decoding."""
        return self.decoded / self.tracked


def measure(contacts: int, frames: int = FRAMES) -> FrameRates:
    """With this many contacts that move; the best of some rounds."""
    chunks = [frame(number, 1, contacts) for number in range(frames)]
    rounds = [_round(chunks) for _ in range(4)]
    return FrameRates(*(max(found) for found in zip(*rounds)))


def _round(chunks: list[bytes]) -> FrameRates:
    host = Conversation("bytes")
    host.receive(greeting(), 0.0)
    arrived: list[Zones] = []

    def decode() -> None:
        for chunk in chunks:
            for event in host.receive(chunk, 0.0):
                if isinstance(event, Arrival):
                    event.zones[0]  # its places, which are computed when they are asked for
                    arrived.append(event.zones)

    tracker = Tracker()
    decoded = _rate(decode, len(chunks))
    tracked = _rate(lambda: [tracker.update(zones) for zones in arrived], len(arrived))
    assert len(arrived) == len(chunks)
    return FrameRates(decoded, tracked)


def _rate(work: Callable[[], object], count: int) -> float:
    started = time.process_time()
    work()
    return count / (time.process_time() - started)


HEAD = ("tracker", "MOTA, %", "IDF1, %", "id switches per 1,000 frames")
LOOKS = {"`Tracker`": (style.BLUE, "solid"), "nearest zone": (style.VERMILLION, style.DASHES[1])}


def scores_table() -> str:
    """Random scenes."""
    rows: list[tuple[str, ...]] = [("scenes", "frames per second", *HEAD)]
    for (family, rate), found in scores.all_scenes().items():
        rows += _scores(family, rate, found)
    return writer.table_of(rows)


def scores_sample() -> str:
    """Two rows of :func:`scores_table`."""
    return "\n".join(map(writer.line, _scores("meeting", 50.0, scores.of_family("meeting", 50.0))))


def _scores(family: str, rate: float, found: scores.Scores) -> Iterator[tuple[str, ...]]:
    for number, (tracker, score) in enumerate(found.items()):
        first = (f"`{family}`", f"{rate:,g}") if number == 0 else ("", "")
        yield (*first, tracker, *score.cells)


def recorded_table() -> str:
    """Recordings."""
    rows = [("recording", "frames taken", *HEAD)]
    for path in sorted(RECORDINGS.glob("*.npz")):
        for every in scores.EVERY:
            for number, (tracker, score) in enumerate(scores.of_recording(path, every).items()):
                taken = "all" if every == 1 else f"one of {every}"
                first = (path.name.partition(".")[0], taken) if number == 0 else ("", "")
                rows.append((*first, tracker, *score.cells))
    return writer.table_of(rows)


def breaks_table() -> str:
    """Where ids are lost."""
    lines = [line for knob in breaks.KNOBS.values() for line in failures_tables.rows(knob, knob.sweep(), False)]
    return writer.table(failures_tables.HEAD, lines)


def speed_table() -> str:
    """On the machine that runs this."""
    rows = [("contacts", "tracked per second", "decoded per second", "tracking takes, in times of decoding")]
    for contacts in (1, 2):
        found = measure(contacts)
        rows.append((str(contacts), f"{found.tracked:,.0f}", f"{found.decoded:,.0f}", f"{found.ratio:.2f}"))
    return writer.table_of(rows)


def reflex_table() -> str:
    """On the machine that runs this."""
    return writer.table_of([reflex.HEAD, reflex.measured().cells])


def draw(folder: Path) -> Path:
    """How often ids are right, by family, rate and tracker."""
    import matplotlib

    with matplotlib.rc_context(style.SETTINGS):
        figure = style.new(3.1)
        panels = figure.subplots(1, len(scenes.FAMILIES), sharey=True)
        for axes, family in zip(panels, scenes.FAMILIES):
            for tracker, (color, dashes) in LOOKS.items():
                values = [100 * scores.of_family(family, rate)[tracker].idf1 for rate in scores.RATES_HZ]
                name = tracker.replace("`", "")
                axes.plot(scores.RATES_HZ, values, color=color, ls=dashes, marker="o", ms=4, label=name)
            axes.set(title=family, xscale="log", ylim=(0, 105), xticks=[30, 100, 300, 1000])
            axes.set_xticklabels(["30", "", "300", ""])
            axes.minorticks_off()
            axes.grid(True)
        panels[0].set_ylabel("IDF1, %")
        figure.supxlabel("frames per second", fontsize=style.NORMAL)
        figure.legend(*panels[0].get_legend_handles_labels(), loc="outside upper right", ncols=2)
        return style.save(figure, folder / "tracking.svg")
