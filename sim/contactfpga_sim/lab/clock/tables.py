"""Board time on the host's clock over simulated transports, for docs/clock.md."""

from __future__ import annotations

import dataclasses
import random
from collections.abc import Iterable, Iterator
from typing import NamedTuple

import numpy as np

from contactfpga.driver.clock import ClockFit
from contactfpga_sim.lab import writer

SECONDS, SEEDS = 60.0, 8
WANDER_PPM, WANDER_S = 1.0, 60.0
"""Swing of a crystal's rate with temperature, and period."""
SENT_S = 150e-6
"""Time from the sample of the first row to the last byte, with WIRE_S for bytes."""
WIRE_S = 57e-6
REQUEST_S, SCAN_S = 30e-6, 100e-6
"""Request on the wire, and longest wait for a scan."""


@dataclasses.dataclass(frozen=True)
class Path:
    """Way of bytes from the wire to the program."""

    title: str
    tick_s: float
    """Delivery period to the program."""
    out_tick_s: float
    """Delivery period to the board."""
    jitter_s: float
    """Mean host delay, exponentially distributed."""
    rate_hz: float = 1000.0
    asked_s: float = 1.0
    stall: float = 0.0
    """Share of frames 20 ms late because the host is busy."""


PATHS = {
    "usb_125us": Path("USB, microframes of 125 µs", 125e-6, 125e-6, 20e-6),
    "usb_1ms": Path("USB, frames of 1 ms", 1e-3, 1e-3, 50e-6),
    "usb_once": Path("the same, asked once, when the port is opened", 1e-3, 1e-3, 50e-6, asked_s=1e9),
    "busy": Path("USB, frames of 1 ms, and one frame of ten waits for 20 ms", 1e-3, 1e-3, 1e-3, stall=0.1),
    "ftdi_16ms": Path("FTDI latency timer of 16 ms", 16e-3, 1e-3, 50e-6),
    "slow": Path("the same, 2 frames per second", 16e-3, 1e-3, 50e-6, rate_hz=2.0),
    "net": Path("network, batches of 10 ms", 10e-3, 1e-3, 1e-3),
}


class Moment(NamedTuple):
    time_us: int
    arrived_s: float
    sampled_s: float
    """True sample time on the host's clock."""
    asked_s: float | None
    """Sending time of the request it answers first."""


class FrameTimes(NamedTuple):
    found_s: np.ndarray
    sigma_s: np.ndarray
    arrived_s: np.ndarray
    sampled_s: np.ndarray

    @property
    def errors_s(self) -> np.ndarray:
        return self.found_s - self.sampled_s


def moments(path: Path, ppm: float, seed: int, seconds: float = SECONDS) -> Iterator[Moment]:
    """Frames of a board whose clock is off by ``ppm``."""
    rng = random.Random(seed)
    base_s, phase_s = rng.uniform(0, 1000), rng.uniform(0, path.tick_s)
    device_s = np.arange(1 / path.rate_hz, seconds, 1 / path.rate_hz)
    drift = ppm * device_s - WANDER_PPM * WANDER_S / (2 * np.pi) * np.cos(2 * np.pi * device_s / WANDER_S)
    ask_s, last_s = base_s, 0.0
    for now_s, sampled_s in zip(device_s.tolist(), (base_s + device_s + drift * 1e-6).tolist()):
        asked = None
        if ask_s < sampled_s:
            asked = sampled_s - REQUEST_S - rng.uniform(0, SCAN_S) - rng.uniform(0, path.out_tick_s)
            ask_s = sampled_s + path.asked_s
        ticks = -(-(sampled_s + SENT_S - phase_s) // path.tick_s)
        wait_s = rng.expovariate(1 / path.jitter_s) + (0.02 if rng.random() < path.stall else 0.0)
        last_s = max(last_s, phase_s + ticks * path.tick_s + wait_s)
        yield Moment(round(now_s * 1e6), last_s, sampled_s, asked)


def followed(frames: Iterator[Moment], fit: ClockFit | None = None) -> FrameTimes:
    fit = fit or ClockFit()
    rows = []
    for moment in frames:
        fit.arrived(moment.time_us, moment.arrived_s, WIRE_S)
        if moment.asked_s is not None:
            fit.answered(moment.time_us, moment.asked_s)
        line = fit.line(moment.arrived_s)
        assert line is not None
        rows.append((line.at(moment.time_us), line.sigma_s, moment.arrived_s, moment.sampled_s))
    return FrameTimes(*np.array(rows).T)


class Accuracy(NamedTuple):
    """Errors over all runs of a path without the first second of each."""

    late_s: float
    error_s: float
    """Median magnitude of the error."""
    worst_s: float
    """99 % quantile of the error."""
    sigma_s: float
    within: float
    """Share of errors within two stated uncertainties."""


def accuracy(path: Path, seeds: int = SEEDS, seconds: float = SECONDS) -> Accuracy:
    """Accuracy over clocks off by -80 to 80 ppm."""
    runs = []
    for seed in range(seeds):
        ppm = -80 + 160 * seed / max(1, seeds - 1)
        frames = followed(moments(path, ppm, seed, seconds))
        runs.append(np.array([part[frames.sampled_s > frames.sampled_s[0] + 1] for part in frames]))
    found = FrameTimes(*np.concatenate(runs, axis=1))
    errors = np.abs(found.errors_s)
    late_s = float((found.arrived_s - found.sampled_s).mean())
    middle, worst = float(np.median(errors)), float(np.quantile(errors, 0.99))
    return Accuracy(late_s, middle, worst, float(np.median(found.sigma_s)), float((errors <= 2 * found.sigma_s).mean()))


HEAD = (
    "way to the host",
    "arrival is late by",
    "error, median",
    "99 %",
    "`host_sigma_s`",
    "error within 2 sigma",
)


def accuracy_table(names: Iterable[str] = PATHS) -> str:
    rows: list[tuple[str, ...]] = [HEAD]
    for path in (PATHS[name] for name in names):
        found = accuracy(path)
        times = (found.late_s, found.error_s, found.worst_s, found.sigma_s)
        rows.append((path.title, *(f"{1e6 * time_s:,.0f} µs" for time_s in times), f"{100 * found.within:.0f} %"))
    return writer.table_of(rows)


def slow_sample() -> str:
    return accuracy_table(("slow",)).splitlines()[-1]
