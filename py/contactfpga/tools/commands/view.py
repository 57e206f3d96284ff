"""The command `contactfpga view`."""

from __future__ import annotations

import argparse
import contextlib
import os
import sys

from contactfpga import terminal
from contactfpga.tools.console import flags, interrupt, numbers

EXTRA = "view"

WHAT = (
    "Device path, name:NAME, usb:SERIAL or zenoh://KEY of a board, flexitac://DEVICE, sim://, a recording's file, or "
    "ROBOT.toml (default: a virtual sheet to press)."
)


def add_flags(flag: flags.Flags) -> None:
    skin = "Skin of the virtual sheet; of a board: require one that was built from it, and use its baud rate."
    flags.connection(flag, WHAT, skin)
    flag("--flat", "A flat virtual sheet instead of one around a forearm.")
    flag("--link NAME", "Board to show from a recording of several (default: all of a robot, or the first).")
    units = "Pressure units (docs/haptics.md): shows the force at each contact (default: those of sim://)."
    flag("--units FILE", units)
    model = "A robot in MuJoCo that wears the sheets of ROBOT.toml and is pushed with the mouse (docs/mujoco.md)."
    flag("--mujoco MODEL.xml", model)
    flag("--reflex FILE.py", "Reflexes of that robot, which is Python code and runs, such as examples/arm/reflexes.py.")
    gateware = "Zones of that robot by the compiled gateware, slower than real time (default: by the golden model)."
    flag("--gateware", gateware)
    host = "Address to listen on (default: 127.0.0.1, which only this computer can reach)."
    flag("--host HOST", host, default="127.0.0.1")
    port = "Port to listen on; 0 is any free one (default: the first free one from 8080 on)."
    flag("--http-port N", port, numbers.whole(0, 65_535))
    flag("--no-browser", "Print the address only.")
    flags.seconds(flag)


def run(args: argparse.Namespace) -> int:
    from contactfpga.tools.view import opening
    from contactfpga.tools.view.bodies import RobotView
    from contactfpga.tools.view.playback import Player

    if args.mujoco is not None:
        args.extra = "view,mujoco"
    with contextlib.ExitStack() as stack:
        with terminal.reading(args.port or "") as tell:
            named = opening.ViewRequest(
                args.port,
                args.skin,
                args.baud,
                args.timeout,
                args.link,
                args.units,
                args.flat,
                tell,
                args.mujoco,
                args.reflex,
                args.gateware,
            )
            shown = stack.enter_context(opening.opened(named, args.host, args.http_port))
        stack.enter_context(interrupt.usual_end())
        terminal.say(f"Open {shown.url}")
        can = "see the recording" if isinstance(shown.source, Player) else "read and press"
        terminal.say(f"Whoever has this address can {can}. Ctrl-C ends it.", hang=2)
        if isinstance(shown.view, RobotView) and (left_out := shown.view.stage.left_out()):
            terminal.say(f"meshes: {left_out}", hang=2)
        if not args.no_browser and _has_display():
            opening.browse(shown.url)
        opening.run(shown, args.seconds)
    return 0


def _has_display() -> bool:
    return not sys.platform.startswith("linux") or any(map(os.environ.get, ("DISPLAY", "WAYLAND_DISPLAY")))
