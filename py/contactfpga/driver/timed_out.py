"""Why no frame came in time, as far as counters tell, and what to do about it."""

from __future__ import annotations

from contactfpga.driver.conversation import Conversation
from contactfpga.driver.stats import NetCounters, refused
from contactfpga.errors import BoardSilent, OnlyNoise, ReadTimeout


def timed_out(name: str, timeout: float, said: Conversation, start: int, net: NetCounters | None) -> ReadTimeout:
    """The error of a port on which no frame came within ``timeout`` seconds; ``start``: bytes that had come before.
    ``net``: what is counted about the network; None: there is none."""
    stats = said.stats
    head = f"{name}: no frame within {timeout:g} s"
    if net is not None:
        head += refused(net)
    if stats.bytes == start:
        return BoardSilent(
            f"{head}, not one byte came; is the board powered and its bitstream loaded, is this its port? "
            f"`contactfpga doctor {name}` checks"
        )
    seen = f"{stats.bytes - start} bytes came"
    if not stats.hellos and (numbers := sorted(said.numbers)):
        ports = ", ".join(f"{name}#{number}" for number in numbers)
        return OnlyNoise(f"{name}: this board serves several sheets; open one of them: {ports}")
    if not stats.frames and not stats.hellos:
        damaged = ", ".join(f"{count} {reason}" for reason, count in stats.damaged.items()) or "none whole"
        return OnlyNoise(
            f"{head}; {seen}, but no valid packet ({damaged}); is the baud rate the Skin's, "
            "and is this a contactfpga board?"
        )
    step = "send less to the board"
    if net is not None:
        step = "if there are access rules, let this program write to KEY/ask"
    return ReadTimeout(
        f"{head}; {seen}, {stats.hellos} hellos and {stats.frames} frames since the port was opened; "
        f"give it a longer timeout, or {step}"
    )
