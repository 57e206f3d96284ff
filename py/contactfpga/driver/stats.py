"""What is counted about a port."""

from __future__ import annotations

import dataclasses
from collections import Counter
from collections.abc import Iterable


@dataclasses.dataclass
class NetCounters:
    """What happened between a publisher and a ``zenoh://`` port."""

    messages: int = 0
    """Messages received."""
    lost_messages: int = 0
    """Messages that did not come: dropped by choice where the network was too slow, or while it was broken."""
    lost_bytes: int = 0
    """Bytes of the board in them."""
    refused: int = 0
    """Messages that were dropped: malformed, duplicate, late, from a second publisher of the key, or followed by no
    later message."""
    publishers: int = 0
    """Publishers that were heard: 1, and one more for each restart."""
    breaks: int = 0
    """Holes after which times are not known before the next hello."""
    passed_breaks: int = 0
    """Those of them that were read, or left out, up to now."""
    left_out: int = 0
    """Bytes that this program did not take in time."""
    denied: int = 0
    """Messages to the board, of all programs, that the publisher did not pass on."""


@dataclasses.dataclass
class Stats:
    """What came over one port since it was opened.

    >>> with contactfpga.open("sim://") as board:
    ...     zones = board.next()
    ...     board.stats.lost
    0
    """

    frames: int = 0
    """Frames received whole and passed on."""
    lost: int = 0
    """Frames that the board sent and that did not arrive whole. Counted from gaps in the sequence numbers, and exact at
    each hello, which says how many frames the board has sent."""
    unexplained: int = 0
    """Frames received whole but not passed on, because their times could not be known before the next hello: after a
    pause on the line, or when the board restarted and no hello has said so yet."""
    dropped: int = 0
    """Frames that were dropped from the queue of ``Board.next``, the oldest first, because it was full."""
    overwritten: int = 0
    """Frames that the board replaced by newer ones before it sent them; each gap counts modulo
    2^``Widths.overwritten_bits``."""
    damaged: Counter[str] = dataclasses.field(default_factory=Counter)
    """Packets refused, by reason: framing, crc, length, kind, content, noise."""
    resynchronized: int = 0
    """Valid packets that followed damaged ones."""
    hellos: int = 0
    """Hellos received."""
    fault_reports: int = 0
    """Reports of faults received, from a board that names them: one after each hello, and one when they change."""
    sweeps: int = 0
    """Sweeps of the pressure units received."""
    sweeps_lost: int = 0
    """Sweeps that did not arrive, because newer ones replaced them while frames filled the line, or because they were
    damaged; each gap counts modulo 256."""
    sweeps_unexplained: int = 0
    """Sweeps received but not passed on, because their times could not be known before the next frame."""
    before_hello: int = 0
    """Packets that came before the first hello, without which they cannot be read."""
    unknown_kinds: int = 0
    """Valid packets of kinds that this host does not know."""
    foreign_version: int = 0
    """Packets of protocol 1."""
    foreign_skin: int = 0
    """Frames of a board that was built from a different Skin than the one asked for."""
    skin_changes: int = 0
    """Hellos with a different Skin than the hello before."""
    restarts: int = 0
    """How often the board restarted, according to its hellos."""
    bytes: int = 0
    """All bytes received."""

    net: NetCounters | None = None
    """What happened on the network, for a ``zenoh://`` port; None for any other port."""

    def to_dict(self) -> dict[str, object]:
        """Everything in plain Python values, ready for JSON."""
        net = None if self.net is None else dataclasses.asdict(self.net)
        return {**vars(self), "damaged": dict(self.damaged), "net": net}


def total(every: Iterable[Stats]) -> Stats:
    """All of them added up."""
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
    """For an error message: what else was sent under the key, if anything was."""
    if not counters.refused:
        return ""
    return f" (messages under its key that it did not send: {counters.refused}; docs/net.md says who can send there)"
