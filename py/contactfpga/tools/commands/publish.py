"""The command `contactfpga publish`."""

from __future__ import annotations

import argparse
import contextlib
import os
import queue
import sys
import threading
import time
from collections.abc import Mapping
from typing import TYPE_CHECKING, NoReturn

from contactfpga import terminal
from contactfpga.driver import driver
from contactfpga.driver.address import NET, SheetOf, checked_key
from contactfpga.driver.transport import connect
from contactfpga.errors import ContactFPGAError
from contactfpga.robot.net.session import is_loopback, key_of
from contactfpga.tools.console import flags, interrupt, numbers

if TYPE_CHECKING:
    from contactfpga.driver.transport import Transport
    from contactfpga.robot.net.publisher import BoardPublisher

EXTRA = "net"

PORTS = (
    "Device path, name:NAME or usb:SERIAL of a board (PORT#1: sheet 1 of several at one board), or sim://. Several of "
    "them publish several boards (default: the one supported board plugged in; with --skin, the one with that Skin)."
)
SHOWN_S = 0.2
"""Interval of checks; boards lost within it, as all sheets of one FPGA, are reported together."""


def add_flags(flag: flags.Flags) -> None:
    flag("[PORT ...]", PORTS, dest="ports")
    flags.reading(flag)
    flag("--key KEY", "Name of a single board on the network (default: contactfpga/ and its name, or its fingerprint).")
    listen = "Listen there, such as tcp/0.0.0.0:7447 for all (default: a Unix socket that only your programs reach)."
    flag("--listen ENDPOINT", listen)
    flag("--connect ENDPOINT", "Do not listen; connect to the router there.")
    flag("--config FILE", "Zenoh's own configuration (JSON5): TLS, users, access.")
    batch = "Collect bytes for T ms before sending them (default: 2; 0: send at once)."
    flag("--batch-ms T", batch, numbers.number(0, 1000, "ms"), 2.0)
    slow = "When the network is too slow: block until it takes more, or drop."
    flag("--congestion", slow, ("block", "drop"), "block")
    flag("--allow-commands", "Pass commands on to the board too, not only requests for frames.")


def run(args: argparse.Namespace) -> int:
    """Run until Ctrl-C, or until every board is gone."""
    if args.listen and args.connect:
        raise ContactFPGAError("give --listen or --connect, not both")
    if args.key is not None and len(args.ports) > 1:
        raise ContactFPGAError(f"--key {args.key} names one board, and there are {len(args.ports)}; leave it out")
    from contactfpga.robot.net import session
    from contactfpga.robot.net.publisher import BoardPublisher

    key = None if args.key is None else checked_key(args.key)
    boards = _look(args, key)
    here = args.connect or args.listen
    batch_s, block = args.batch_ms / 1000, args.congestion == "block"
    with contextlib.ExitStack() as ending:
        open_session = session.connected if args.connect else session.listening
        network = ending.enter_context(open_session(here, args.config))
        publishers: dict[BoardPublisher, Transport] = {}
        for of, (device, baud) in boards.items():
            transport = connect(device, baud, pace=1.0)
            ending.callback(transport.close)
            options = {"batch_s": batch_s, "block": block, "commands": args.allow_commands}
            publishers[BoardPublisher(transport, network, of, **options)] = transport
        with interrupt.usual_end():  # from the first line on, which tells that it runs
            for of in boards:
                print(f"{NET}{of}" + (f"?connect={here}" if here else ""), flush=True)
            _warn(args)
            return _publish(publishers)
    return 0


def _look(args: argparse.Namespace, key: str | None) -> dict[str, tuple[str, int]]:
    found: dict[str, tuple[str, int]] = {}
    for port in args.ports or [None]:
        if port is not None and port.startswith(("replay:", NET)):
            raise ContactFPGAError(f"port is {port!r}; publish a board, not a recording or what is published already")
        with driver.open(port, args.skin, baud=args.baud, timeout=args.timeout) as board:
            of = key or key_of(board.hello.name, board.hello.fingerprint)
            if of in found:
                _refuse(found[of][0], board.port, of)
            found[of] = board.port, args.baud or board.hello.baud
    return found


def _refuse(first: str, second: str, of: str) -> NoReturn:
    if _place(first) == _place(second) != ("sim", None):
        raise ContactFPGAError(f"{second} is the port {first}, which is named already; name it once")
    raise ContactFPGAError(f"{first} and {second} would both be {of}; give their Skins different names")


def _place(port: str) -> tuple[str, int | None]:
    """The device of a port and the sheet's number; each bare ``sim://`` is a separate board."""
    sheet = SheetOf.parse(port)
    name, number = (port, None) if sheet is None else (sheet.port, sheet.number)
    virtual = name.startswith("sim:")
    if virtual and number is None:
        return "sim", None
    return name if virtual else os.path.realpath(name), number


def _publish(publishers: Mapping[BoardPublisher, Transport]) -> int:
    stop = threading.Event()
    ended: queue.SimpleQueue[Exception] = queue.SimpleQueue()
    threads = [threading.Thread(target=_run, args=(*one, stop, ended), daemon=True) for one in publishers.items()]
    gone = 0
    try:
        with interrupt.usual_end():
            for thread in threads:
                thread.start()
            while gone < len(publishers):
                failures = _ended(ended)
                gone += len(failures)
                others = "; the others go on" if gone < len(publishers) else ""
                for failure in dict.fromkeys(failures):  # that of a port is the same for all of its sheets
                    interrupt.failed(f"{failure}{others}")
    finally:
        stop.set()
        for thread in threads:
            if thread.ident is not None:  # a signal may come before all are started
                thread.join()
    return 1 if gone else 0


def _ended(ended: queue.SimpleQueue[Exception]) -> list[Exception]:
    try:
        found = [ended.get(timeout=SHOWN_S)]
    except queue.Empty:
        return []
    time.sleep(SHOWN_S)
    while not ended.empty():
        found.append(ended.get())
    return found


def _run(
    publisher: BoardPublisher, transport: Transport, stop: threading.Event, ended: queue.SimpleQueue[Exception]
) -> None:
    try:
        publisher.run(stop)
    except Exception as error:
        ended.put(error)
    finally:
        transport.close()  # a device that is held keeps its name from the board that is plugged in again


def _warn(args: argparse.Namespace) -> None:
    if args.listen and not is_loopback(args.listen) and args.config is None:
        terminal.say(
            f"whoever reaches {args.listen} can read this board; docs/net.md says how to ask for certificates and "
            "users",
            sys.stderr,
        )
    if args.allow_commands:
        terminal.say("commands are passed on to the board", sys.stderr)
