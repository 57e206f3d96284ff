"""Counters of a port."""

from __future__ import annotations

import dataclasses
from collections import Counter
from collections.abc import Iterable


@dataclasses.dataclass
class NetCounters:
    """Counters between a publisher and a ``zenoh://`` port."""

    messages: int = 0
    """Messages received."""
    lost_messages: int = 0
    """Messages that did not arrive, because the network was too slow or broken."""
    lost_bytes: int = 0
    """Bytes of the board in lost messages."""
    refused: int = 0
    """Messages dropped as malformed, duplicate, late, of a second publisher, or followed by no later message."""
    publishers: int = 0
    """Publishers heard: 1, plus one for each restart."""
    breaks: int = 0
    """Gaps after which times are unknown until the next hello."""
    passed_breaks: int = 0
    """Those of :attr:`breaks` that were read or skipped so far."""
    left_out: int = 0
    """Bytes that this program did not take in time."""
    denied: int = 0
    """Messages of all programs to the board that the publisher refused."""


@dataclasses.dataclass
class Stats:
    """Counters of one port since it was opened.

    >>> with contactfpga.open("sim://") as board:
    ...     zones = board.next()
    ...     board.stats.lost
    0
    """

    frames: int = 0
    """Frames received whole and passed on."""
    lost: int = 0
    """Frames that the board sent and that did not arrive whole, by gaps in the sequence numbers; exact at each hello,
    which has the number of sent frames.
    """
    unexplained: int = 0
    """Whole frames that were not passed on, because a pause or restart made their times unknown until the next
    hello.
    """
    dropped: int = 0
    """Frames dropped from the full queue of ``Board.next``, oldest first."""
    overwritten: int = 0
    """Frames replaced by newer ones on the board; each gap counts modulo 2^``Widths.overwritten_bits``."""
    damaged: Counter[str] = dataclasses.field(default_factory=Counter)
    """Refused packets, by reason: framing, crc, length, kind, content, noise."""
    resynchronized: int = 0
    """Valid packets that followed damaged ones."""
    hellos: int = 0
    """Hellos received."""
    fault_reports: int = 0
    """Fault reports received: one after each hello, and one on each change."""
    sweeps: int = 0
    """Sweeps of the pressure units received."""
    sweeps_lost: int = 0
    """Sweeps that were damaged, or replaced by newer ones on a full line; each gap counts modulo 256."""
    sweeps_unexplained: int = 0
    """Sweeps that were not passed on, because no frame gave their times yet."""
    before_hello: int = 0
    """Packets before the first hello, which are unreadable."""
    unknown_kinds: int = 0
    """Valid packets of kinds unknown to this host."""
    foreign_version: int = 0
    """Packets of protocol 1."""
    foreign_skin: int = 0
    """Frames of a board with a different Skin than requested."""
    skin_changes: int = 0
    """Hellos with a different Skin than the hello before."""
    restarts: int = 0
    """Restarts of the board, by its hellos."""
    bytes: int = 0
    """All bytes received."""

    net: NetCounters | None = None
    """Counters of the network for a ``zenoh://`` port; otherwise None."""

    def to_dict(self) -> dict[str, object]:
        """All counters as plain Python values, ready for JSON."""
        net = None if self.net is None else dataclasses.asdict(self.net)
        return {**vars(self), "damaged": dict(self.damaged), "net": net}


def total(every: Iterable[Stats]) -> Stats:
    found = Stats()
    for one in every:
        for field in dataclasses.fields(Stats):
            if field.name != "net":
                setattr(found, field.name, getattr(found, field.name) + getattr(one, field.name))
        if one.net is not None:
            before = found.net or NetCounters()
            names = [field.name for field in dataclasses.fields(NetCounters)]
            found.net = NetCounters(**{name: getattr(before, name) + getattr(one.net, name) for name in names})
    return found


def refused(counters: NetCounters) -> str:
    """Addition to an error message: refused messages under the key, if any."""
    if not counters.refused:
        return ""
    return f" (messages under its key that it did not send: {counters.refused}; docs/net.md says who can send there)"
