"""The command `contactfpga latency`."""

from __future__ import annotations

import argparse
import re
from pathlib import Path
from typing import TYPE_CHECKING

from contactfpga import boards
from contactfpga.driver import health
from contactfpga.skin import Skin
from contactfpga.tools.console import flags, numbers, outputs, results

if TYPE_CHECKING:
    from contactfpga_sim.apps.latency.spread import Spread
    from contactfpga_sim.apps.latency.stages import Finger

EXTRA = "sim"

CELLS = re.compile(r"([1-9][0-9]?)x([1-9][0-9]?)")

BOARD = "icebreaker"

ENDINGS = (".svg", ".png")


def add_flags(flag: flags.Flags) -> None:
    flags.sheet(flag, "Skin to measure (default: that of --board, else the reference Skin).")
    bridge = f"Board whose USB bridge is taken: {', '.join(boards.BOARDS)}, or one of your own (default: {BOARD})."
    flag("--board NAME", bridge)
    flag("--cells HxW", "Rows and columns of the contact (default: 3x3, a fingertip).", _cells, (3, 3))
    count = "Number of places to touch, spread over the sheet (default: every place)."
    flag("--touches N", count, numbers.whole(1, 4096))
    own = health.LATENCY_MS
    timer = f"Latency timer of the bridge in ms (default: {own}, as `contactfpga doctor` advises; a new bridge has 16)."
    flag("--timer MS", timer, numbers.whole(1, 255, "ms"), own)
    asks = "Requests of the host per USB frame or microframe, evenly spaced (default: 1, the worst; EHCI: about 10)."
    flag("--asks N", asks, numbers.whole(1, 100), 1)
    flag("--no-event-char", "Take a bridge without event character, as a new one is.")
    flag("--exact", "Leave out the host's share, which is measured on this machine and varies.")
    flag("--picture FILE", "Draw a bar for each stage, SVG or PNG by the ending.")
    flags.json(flag)


def run(args: argparse.Namespace) -> int:
    from contactfpga_sim.apps import pool
    from contactfpga_sim.apps.latency import host, stages
    from contactfpga_sim.apps.latency.usb import BridgeSettings

    path = _picture(args.picture)
    named, file = flags.board(args), flags.sheet_file(args)
    board = named or boards.find(BOARD)
    skin = board.load(file) if named and file else Skin.load(file) if file else named.skin if named else Skin()
    event = None if args.no_event_char else health.EVENT_CHAR & 0xFF
    settings = BridgeSettings(board.bridge, args.timer, event, args.asks)
    with pool.progress() as step:
        touches = 0 if args.exact else host.TOUCHES
        found = stages.measure(skin, settings, args.cells, args.touches, host_touches=touches, step=step)
    if path is not None:
        from contactfpga_sim.apps.latency import picture

        sheet = f"{skin.rows}x{skin.columns}, scan {skin.scan!r}, {skin.baud / 1e6:g} Mbaud"
        picture.save(found, f"{sheet}, {board.bridge.chip} of {board.title}", path)
    rows = *_board_lines(skin, args.cells, found), *_host_lines(board.title, found, args.exact)
    drawn = [] if path is None else [("picture", str(path))]
    results.show(args, found.as_json(), lambda: results.table(*rows, *drawn))
    return 0


def _board_lines(skin: Skin, cells: tuple[int, int], found: Finger) -> list[tuple[str, str]]:
    board, (height, width) = found.board, cells
    sheet = f"{skin.rows}x{skin.columns}, scan {skin.scan!r}, {skin.clock_hz / 1e6:g} MHz, {skin.baud / 1e6:g} Mbaud"
    change = _times(board.change_to_last_byte_us)
    return [
        ("sheet", sheet),
        ("contact", f"{height}x{width} cells at {board.touches} places, on the compiled gateware"),
        ("touch to contact pin", _times(board.touch_to_contact_us, 2)),
        ("touch to last byte", _times(board.touch_to_last_byte_us)),
        ("change to last byte", f"{change}, with frames on the wire"),
        ("frames per second", f"{board.frames_per_s:,.0f} while it moves"),
        ("bytes", f"{board.bytes} in a frame with the contact"),
    ]


def _host_lines(title: str, found: Finger, exact: bool) -> list[tuple[str, str]]:
    from contactfpga_sim.apps.latency import stages

    settings, share = found.settings, found.host
    event = "no event character" if settings.event is None else f"event character {settings.event}"
    every_us = settings.chip.frame_us / settings.asks
    every = f"{every_us:g} us" if every_us < 1000 else "1 ms"
    bridge = f"{settings.chip.chip} of {title}, asked every {every}, latency timer {settings.timer_ms} ms, {event}"
    lines = [
        ("bridge", bridge),
        ("last byte to host", f"{_times(found.bridge_us)}, by a model of the bridge over all its phases"),
        ("touch to host", f"{_times(found.usb_us)}, at its USB controller"),
    ]
    if share is not None and found.user_code_us is not None:
        late = f", {share.left_out} left out as the machine was busy" if share.left_out else ""
        lines += [
            ("host to user code", f"{_times(share.us)}, measured by {share.touches} touches through the driver{late}"),
            ("measured on", share.machine),
            ("touch to user code", f"{_times(found.user_code_us)}, on that machine"),
        ]
    elif not exact:
        lines.append(("host to user code", "not measured: this machine has no pseudo-terminals, or is too busy"))
    assumed, paper = f"{stages.ASSUMED_HOST_US:g} us", f"{stages.PAPER_US:,.0f} us"
    decision = f"{_times(found.decision_us)}, with {assumed} for the host as in `contactfpga study arm`"
    return [
        *lines,
        ("touch to decision", decision),
        ("the paper", f"{paper} for the same, its sheet and control together"),
    ]


def _times(us: Spread, digits: int = 1) -> str:
    return f"{us.median:.{digits}f} us median, {us.p99:.{digits}f} us 99 %, {us.worst:.{digits}f} us worst"


def _picture(name: str | None) -> Path | None:
    if name is None:
        return None
    if Path(name).suffix.lower() not in ENDINGS:
        raise ValueError(f"--picture is {name!r}; it must end in {' or '.join(ENDINGS)}")
    return outputs.file(name, "--picture")


def _cells(text: str) -> tuple[int, int]:
    found = CELLS.fullmatch(text)
    if not found:
        shown = numbers.shortened(text)
        raise argparse.ArgumentTypeError(f"{shown!r} is not a size; write rows x columns of the contact, such as 3x3")
    return int(found[1]), int(found[2])
