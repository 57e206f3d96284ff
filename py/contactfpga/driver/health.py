"""Checks of the path between this computer and a board, with remedies."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Literal, NamedTuple

from contactfpga.driver import finding, native
from contactfpga.driver.address import FLEXITAC, SheetOf
from contactfpga.driver.driver import Board
from contactfpga.errors import ReplayEnded
from contactfpga.inputs.values import shell_words
from contactfpga.wire.faults import STUCK, UNPLUGGED
from contactfpga.wire.hello import report_of
from contactfpga.zones.units import only
from contactfpga.zones.zone import Zones

USB_SERIAL = Path("/sys/bus/usb-serial/devices")
RULE_FILE = "/etc/udev/rules.d/70-contactfpga.rules"

LATENCY_MS = 1
EVENT_CHAR = 0x100
"""FTDI event character at which the chip passes its buffer on: byte 0, the delimiter, and bit 8 to enable it."""

CLOCK_ERROR = 0.01
JITTER_S = 0.03
"""Jitter of arrivals with an FTDI chip's default latency."""


class Finding(NamedTuple):
    verdict: Literal["ok", "note", "fault"]
    sentence: str
    """The result, with the next step if there is one."""


def rights(port: str) -> Iterator[Finding]:
    if sys.platform == "win32":
        return
    if not os.path.exists(port):
        yield Finding("fault", f"{port} does not exist; is the board plugged in?")
    elif os.access(port, os.R_OK | os.W_OK):
        yield Finding("ok", f"{port} may be read and written")
    else:
        yield Finding("fault", f"{port} may not be read and written; add yourself to its group: {_group_command(port)}")


def _group_command(port: str) -> str:
    import grp

    group = os.stat(port).st_gid
    return f"sudo usermod -aG {grp.getgrgid(group).gr_name} $USER, then log in again"


def ftdi(port: str, folder: Path = USB_SERIAL) -> Iterator[Finding]:
    """Check the FTDI chip's latency timer, and the udev rule for it and the event character."""
    device = folder / Path(port).resolve().name
    timer = device / "latency_timer"
    if not timer.exists():
        return
    latency_ms = int(timer.read_text())
    if latency_ms > LATENCY_MS:
        yield Finding(
            "fault", f"{port}: FTDI latency timer is {latency_ms} ms, it should be {LATENCY_MS} ms; {_advice()}"
        )
    else:
        yield Finding("ok", f"{port}: FTDI latency timer is {latency_ms} ms")
    yield Finding(
        "note",
        f"{port}: the event character, which sends each frame on at its last byte, cannot be read back; {_advice()}",
    )


def udev_rule() -> str:
    """The rule that sets latency timer and event character for all supported boards."""
    return "\n".join(
        f'ACTION=="add", SUBSYSTEM=="usb-serial", DRIVER=="ftdi_sio", ATTRS{{idVendor}}=="{usb.vid:04x}", '
        f'ATTRS{{idProduct}}=="{usb.pid:04x}", ATTR{{latency_timer}}="{LATENCY_MS}", '
        f'ATTR{{event_char}}="{EVENT_CHAR}"'
        for usb in finding.SUPPORTED
    )


def _advice() -> str:
    return f"put this into {RULE_FILE} and plug the board in again:\n{udev_rule()}"


def hello(board: Board) -> Iterator[Finding]:
    sheet = board.sheet
    surface = "plane" if sheet.radius_mm is None else f"cylinder of radius {sheet.radius_mm:g} mm"
    surface = f"closed {surface}" if sheet.closed else surface
    name = f"{board.name!r}, " if board.name else ""
    facts = (
        f"{name}{sheet.rows}x{sheet.columns}, pitch {sheet.pitch_x_mm:g} x {sheet.pitch_y_mm:g} mm, {surface}, "
        f"connectivity {sheet.connectivity}, {report_of(sheet)}, {board.clock_hz / 1e6:g} MHz, {board.baud} baud, "
        f"fingerprint {board.fingerprint.hex()}"
    )
    yield Finding("ok", f"{board.port} {'is read as' if _greeted_here(board) else 'says hello'}: {facts}")


def _greeted_here(board: Board) -> bool:
    """Whether this computer makes the hellos, as the sheet says none."""
    return board.port.startswith(FLEXITAC)


def reader(board: Board) -> Iterator[Finding]:
    if why := native.refusal(board.port):
        yield Finding("note", f"{board.port} is read in Python, not in C: {why}")
    else:
        yield Finding("ok", f"{board.port} is read in C, which waits for no Python thread")


def clock(board_s: float, host_s: float) -> Iterator[Finding]:
    """Compare the board's clock with this computer's, as far as the measured duration allows."""
    if host_s > 0 and abs(off := board_s / host_s - 1) > CLOCK_ERROR + JITTER_S / host_s:
        yield Finding(
            "note",
            f"the board's clock is {100 * abs(off):.1f} % {'fast' if off > 0 else 'slow'}, and so are all times; is "
            "its crystal the Skin's clock_hz? (A virtual board may just not keep up.)",
        )


NEXT_STEPS = {
    UNPLUGGED: "the sheet is unplugged, or its supply is missing",
    "open": "look for a break in the line, its driver or its connector",
    "stuck": "it reads pressed while no row is driven: look for a short circuit there",
    "joined lines": "the self-test found a short circuit between lines",
    "unnamed fault": "its name has not come yet; run this once more",
}
"""Remedy of a fault, by the end of its name."""


def lines(board: Board, zones: Zones) -> Iterator[Finding]:
    if zones.arrived_s is not None:
        yield Finding("ok", f"the last frame came {1000 * board.silence.seconds:.0f} ms ago")
    if zones.faults == (STUCK,):
        count = f"{board.hello.stuck} columns" if board.hello.stuck else "columns"
        yield Finding("fault", f"{count} read pressed while no row is driven; look for a short circuit there")
        return
    reported = board.faults.names if board.faults else ()
    for name in sorted({*zones.faults, *reported}):
        step = next(step for end, step in NEXT_STEPS.items() if name.endswith(end))
        yield Finding("fault", f"{name}: {step}")


def units(board: Board) -> Iterator[Finding]:
    """Check the pressure units' readings during the frame count."""
    history, stats = board.unit_history, board.stats
    if history is None:
        return
    if history.last is None:
        yield Finding("fault", "no readings of the pressure units came: frames leave them no room; set a higher baud")
        return
    full = (1 << history.facts.bits) - 1
    for value, what in ((0, "0"), (full, f"full scale ({full})")):
        found = only(history.lows, history.highs, value)
        if len(found) == history.facts.count:
            yield Finding("fault", f"the converter reads only {what}: look at its supply, its reference and its wires")
        else:
            for unit in found:
                yield Finding("fault", f"unit {unit} reads only {what}: look at its amplifier and at its wires")
    spans = ", ".join(f"{low} to {high}" for low, high in zip(history.lows, history.highs, strict=True))
    yield Finding("ok", f"{history.facts.count} units read {spans}; {stats.sweeps} sweeps, {stats.sweeps_lost} lost")
    if not history.last.armed:
        yield Finding("note", "no threshold is set: the pressure units cannot raise contact")


def _second_reader(board: Board) -> str:
    """Question about a program that takes bytes away, as `cat` does: more frames than each damaged packet explains."""
    damaged = board.stats.damaged.total()
    if "://" in board.port or not 0 < 2 * damaged < board.stats.lost:
        return ""
    sheet = SheetOf.parse(board.port)
    port = board.port if sheet is None else sheet.port
    named = "" if sys.platform == "win32" else f" `{shell_words('fuser', port)}` lists them"
    return f"; does another program read this port?{named}"


def count(board: Board, seconds: float, timeout: float) -> Iterator[Finding]:
    """Count frames and losses over some seconds of device time."""
    try:
        first = zones = board.next(timeout)
    except ReplayEnded:
        yield Finding("fault", f"{board.port} holds no frame")
        return
    begun = board.clock()
    while zones.time_us - first.time_us < seconds * 1e6 and zones.time_us >= first.time_us:
        try:
            zones = board.next(timeout)
        except ReplayEnded:
            yield Finding("note", "the recording ends here")
            break
    yield from clock((zones.time_us - first.time_us) / 1e6, board.clock() - begun)
    stats = board.stats
    hellos = "" if _greeted_here(board) else f", {stats.hellos} hellos"
    yield Finding("ok", f"{stats.frames} frames{hellos} in {(zones.time_us - first.time_us) / 1e6:.2f} s")
    if stats.overwritten:
        yield Finding(
            "note",
            f"{stats.overwritten} frames overwritten on the board: the line is slower than the scan, a hello too",
        )
    if stats.unexplained:
        yield Finding(
            "note", f"{stats.unexplained} frames left out, as their times were not known before the next hello"
        )
    faults = {"lost": stats.lost, "damaged": stats.damaged.total(), "restarts of the board": stats.restarts}
    counts = ", ".join(f"{number} {name}" for name, number in faults.items())
    yield Finding("fault" if any(faults.values()) else "ok", f"{counts}{_second_reader(board)}")
    yield from lines(board, zones)
    yield from units(board)
    for flag in sorted(zones.flags - {"fault"}):
        if flag == "ghost":
            yield Finding("note", "the last frame has zones that may be ghosts: the sheet has no diodes")
        elif flag == "motion":
            yield Finding("note", "in the last frame something moved faster than the scan follows")
        else:
            yield Finding("fault", f"the last frame is flagged {flag!r}")
