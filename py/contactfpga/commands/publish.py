"""`contactfpga publish`: a board's bytes for other programs and machines."""

from __future__ import annotations

import argparse
import sys
import threading

from contactfpga.console import flags, interrupt, numbers, terminal
from contactfpga.driver import driver
from contactfpga.driver.transport import connect
from contactfpga.errors import ContactFPGAError
from contactfpga.net import address
from contactfpga.wire.hello import Hello

HELP = "Publish a board over the network (Eclipse Zenoh); zenoh://KEY reads it."
EXTRA = "net"

PORT = (
    "Device path, name:NAME or usb:SERIAL of a board, or sim:// (default: the one supported board that is plugged in, "
    "with --skin the one of that Skin)."
)


def add_flags(parser: argparse.ArgumentParser) -> None:
    """Add the command's flags to its parser."""
    flags.connection(parser, PORT)
    key = "Name of the board on the network (default: contactfpga/ and its name, or its fingerprint)."
    parser.add_argument("--key", help=key)
    listen = f"Listen there, such as tcp/0.0.0.0:7447 for all (default: {address.ENDPOINT}, this machine only)."
    parser.add_argument("--listen", metavar="ENDPOINT", help=listen)
    parser.add_argument("--connect", metavar="ENDPOINT", help="Do not listen; connect to the router there.")
    parser.add_argument("--config", metavar="FILE", help="Zenoh's own configuration (JSON5): TLS, users, access.")
    batch = "Collect bytes for T ms before sending them (default: 2; 0: send at once)."
    parser.add_argument("--batch-ms", type=numbers.number(0, 1000, "ms"), default=2.0, metavar="T", help=batch)
    slow = "When the network is too slow: block until it takes more, or drop (default: block)."
    parser.add_argument("--congestion", choices=("block", "drop"), default="block", help=slow)
    allow = "Pass commands on to the board too, not only requests for frames."
    parser.add_argument("--allow-commands", action="store_true", help=allow)


def run(args: argparse.Namespace) -> int:
    """Run the command until Ctrl-C."""
    if args.listen and args.connect:
        raise ContactFPGAError("give --listen or --connect, not both")
    from contactfpga.net import session
    from contactfpga.net.publisher import Publisher

    key = None if args.key is None else address.checked_key(args.key)
    hello, device = _look(args)
    key = key or address.key_of(hello.name, hello.fingerprint)
    here = args.connect or args.listen or address.ENDPOINT
    transport = connect(device, args.baud or hello.baud)
    try:
        open_session = session.connected if args.connect else session.listening
        with open_session(args.connect or args.listen, args.config) as network:
            batch_s, block = args.batch_ms / 1000, args.congestion == "block"
            publisher = Publisher(transport, network, key, batch_s=batch_s, block=block, commands=args.allow_commands)
            with interrupt.usual_end():
                print(f"{address.SCHEME}{key}" + ("" if here == address.ENDPOINT else f"?connect={here}"), flush=True)
                _warn(args, here)
                publisher.run(threading.Event())
    finally:
        transport.close()
    return 0


def _look(args: argparse.Namespace) -> tuple[Hello, str]:
    """What the board says of itself, and the device it is on."""
    if args.port is not None and args.port.startswith(("replay:", address.SCHEME)):
        raise ContactFPGAError(f"port is {args.port!r}; publish a board, not a recording or what is published already")
    with driver.open(args.port, args.skin, baud=args.baud, timeout=args.timeout) as board:
        return board.hello, board.port


def _warn(args: argparse.Namespace, here: str) -> None:
    if args.listen and not address.is_loopback(here) and args.config is None:
        terminal.say(
            f"whoever reaches {here} can read this board; docs/net.md says how to ask for certificates and users",
            sys.stderr,
        )
    if args.allow_commands:
        terminal.say("commands are passed on to the board", sys.stderr)
