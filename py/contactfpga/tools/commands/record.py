"""The command `contactfpga record`."""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Callable
from typing import TYPE_CHECKING

from contactfpga import terminal
from contactfpga.driver.board import Board
from contactfpga.errors import ContactFPGAError
from contactfpga.inputs.files import names_robot
from contactfpga.tools.console import flags, interrupt, numbers, results
from contactfpga.tools.console.forces import Forces

if TYPE_CHECKING:
    from contactfpga.robot.body import Body
    from contactfpga.robot.body.plan import Plan
    from contactfpga.robot.ros.feed import Felt
    from contactfpga.tools.recordings.recorder import Session
    from contactfpga.tools.recordings.recover import RecoveryReport

EXTRA = "record"

SHOWN_S = 0.5


def add_flags(flag: flags.Flags) -> None:
    flag("FILE.mcap", "File to write; it must not exist yet. With --recover: the file to repair; it is not changed.")
    robot = "or ROBOT.toml for all boards of a robot (docs/body.md)."
    into = "With --recover: the new file (default: FILE_recovered.mcap)."
    flags.connection(flag, f"{flags.PORT.removesuffix('.')}, {robot} {into}")
    flags.seconds(flag)
    megabytes = "Split the recording into FILE_0001.mcap, FILE_0002.mcap and so on, each about this large."
    flag("--split-mb MB", megabytes, numbers.number(0.1, 1e6, "MB"))
    flag("--split-s S", "The same, each this many seconds long.", numbers.number(1, 86_400, "s"))
    flags.forces(flag, "Add forces")
    bare = "Leave out the messages for other programs: about a fifth of the size; replay and export lose nothing."
    flag("--bytes-only", bare)
    flag("--recover", "Record nothing; repair a recording whose program was killed or whose disk was full.")
    flags.json(flag, "Print one JSON object at the end: files, frames and bytes; with --recover what is left out.")


def run(args: argparse.Namespace) -> int:
    return _recover(args) if args.recover else _record(args)


def _record(args: argparse.Namespace) -> int:
    from contactfpga.robot.body import robot_texts
    from contactfpga.tools.recordings.recorder import Session, Split

    flags.check_forces(args)
    body = _body(args)
    split = None
    if args.split_mb is not None or args.split_s is not None:
        split = Split(None if args.split_mb is None else args.split_mb * 1e6, args.split_s)
    about = {} if body is None else {robot_texts.ROBOT: robot_texts.pack(args.port)}
    session = Session(args.file, split, args.bytes_only, about=about)
    progress = _Progress(session, args)
    try:
        with session:
            _add(session, args, body)
            with interrupt.usual_end():
                session.start(args.seconds)
                while session.running:
                    session.wait(0.05)
                    progress.show()
    finally:
        progress.end()
    return 0


def _body(args: argparse.Namespace) -> Body | None:
    if not names_robot(args.port):
        return None
    from contactfpga.robot.body import Body

    for name in ("skin", "baud", "units", "friction"):
        if getattr(args, name) is not None:
            raise ContactFPGAError(f"--{name} is for a single board; {args.port} sets it for each link")
    return Body.load(args.port)


def _add(session: Session, args: argparse.Namespace, body: Body | None) -> None:
    from contactfpga.tools.recordings.messages import Mount

    if body is None:

        def felt(board: Board) -> Felt | None:
            forces = Forces.of(board, args.units, args.friction)
            return None if forces is None else forces.of_frame

        session.add(args.port, args.skin, baud=args.baud, timeout=args.timeout, felt=felt)
        return
    for plan in body.links.values():
        mount = Mount(plan.frame, plan.place)
        forces = None if plan.units is None else _felt_on(plan)
        session.add(plan.port, plan.skin, name=plan.name, timeout=args.timeout, mount=mount, felt=forces)


def _felt_on(plan: Plan) -> Callable[[Board], Felt]:
    from contactfpga.robot.body.snapshot import forces_of

    return lambda board: lambda zones, tracks: forces_of(plan, zones, tracks)


def _recover(args: argparse.Namespace) -> int:
    from contactfpga.tools.recordings.recover import recover

    for name in ("skin", "baud", "seconds", "split_mb", "split_s", "units", "friction", "bytes_only"):
        if getattr(args, name) not in (None, False):
            raise ContactFPGAError(f"--{name.replace('_', '-')} is for a recording that is made; --recover repairs one")
    found = recover(args.file, args.port)
    answer = {
        "file": found.path,
        "messages": found.messages,
        "duration_s": found.seconds,
        "recordings": found.recordings,
        "usable": found.usable,
        "cut_bytes": found.cut,
        "damaged_pieces": found.damaged,
        "omitted": found.omitted,
        "beyond_bytes": found.beyond,
    }
    results.show(args, answer, lambda: _show_recovered(args.file, found))
    return 0


def _show_recovered(file: str, found: RecoveryReport) -> None:
    terminal.say(f"{found.path}: {found.messages:,} messages of {found.seconds:.1f} s")
    if found.recordings > 1:
        terminal.say(f"{file} holds {found.recordings} recordings, one after the other; the new file has them all.")
    elif found.usable:
        terminal.say(f"Nothing is missing: {file} was closed and whole, so you can use it as it is.")
    if found.cut:
        terminal.say(f"Left out at the end: {found.cut:,} bytes of a piece that is not whole.")
    if found.damaged:
        terminal.say(f"Left out in between: {_pieces(found.damaged)}; frames are missing there.")
    for what, count in found.omitted.items():
        terminal.say(f"Left out: {count:,} {what}.")
    if found.beyond:
        terminal.say(f"Left out after the end: {found.beyond:,} bytes that are no recording.")


def _pieces(count: int) -> str:
    return "1 damaged piece" if count == 1 else f"{count} damaged pieces"


class _Progress:
    def __init__(self, session: Session, args: argparse.Namespace) -> None:
        self._session, self._args = session, args
        self._live = terminal.of(sys.stderr).live
        self._due_s = time.monotonic() + SHOWN_S
        self._shown = False

    def show(self) -> None:
        if self._live and time.monotonic() >= self._due_s:
            self._due_s = time.monotonic() + SHOWN_S
            self._shown = True
            print(f"\r{self._line()}, Ctrl-C ends it", end="\033[K", file=sys.stderr, flush=True)

    def end(self) -> None:
        if self._shown:
            print("\r", end="\033[K", file=sys.stderr, flush=True)
        session = self._session
        if session.files:
            answer = {
                "files": session.files,
                "duration_s": session.seconds,
                "frames": session.frames,
                "bytes": session.size,
                "links": [
                    {"name": one.name, "error": one.error and str(one.error), "notes": one.notes}
                    for one in session.links
                ],
            }
            files = ", ".join(map(str, session.files))
            results.show(self._args, answer, lambda: terminal.say(f"{files}: {self._line()}"))
        for link in session.links:
            lost = [f"{link.name}: {link.error}"] if link.error is not None and len(session.links) > 1 else []
            for note in link.notes + lost:
                terminal.say(f"contactfpga: {note}", sys.stderr, hang=2)

    def _line(self) -> str:
        session = self._session
        hourly = session.size / session.seconds * 3600 / 1e6 if session.seconds else 0.0
        return (
            f"{session.seconds:.1f} s, {session.frames:,} frames, {session.size / 1e6:.2f} MB "
            f"({hourly:,.0f} MB an hour)"
        )
