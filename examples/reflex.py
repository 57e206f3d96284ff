"""A control loop of 1 kHz that stops on contact, and when the skin says nothing: `python examples/reflex.py [PORT]`.

Between two steps it waits for frames: a contact is acted on when its frame comes, not when the next step is due. "No
data" is never "no contact": without a frame for SILENCE_S the loop stops, too. It brakes whatever ends it.
"""

from __future__ import annotations

import signal
import sys
from collections.abc import Callable
from typing import NamedTuple

import contactfpga

PERIOD_S = 0.001
"""From step to step."""

SILENCE_S = 0.005
"""The oldest that the newest frame may be. The board must send every frame (`send = "always"`): one that sends changes
only is silent while nothing changes."""

LOOK_S = 1e-6
"""How long a look takes that waits for nothing."""


class Stop(NamedTuple):
    """Why the loop ended."""

    reason: str
    """`contact`, `fault` (a frame that may be wrong) or `silence`."""
    decided_s: float | None
    """When, on the board's clock; None after an error."""
    zones: contactfpga.Zones | None
    """The frame that told it; None of silence."""
    error: contactfpga.ContactFPGAError | None = None
    """Why no frame can come any more: the board is gone, or has another bitstream."""


def guard(board: contactfpga.Board, step: Callable[[], None], brake: Callable[[], None]) -> Stop:
    """Call ``step`` every PERIOD_S until there is a reason to stop, then ``brake`` at once: also after Ctrl-C and after
    an error of ``step``, which is raised."""
    try:
        return watch(board, step)
    except contactfpga.ContactFPGAError as error:
        return Stop("silence", None, None, error)
    finally:
        brake()


def watch(board: contactfpga.Board, step: Callable[[], None]) -> Stop:
    """Call ``step`` every PERIOD_S until a frame, or its absence, is a reason to stop."""
    heard_s = due_s = board.clock()
    while True:
        step()
        due_s = max(due_s + PERIOD_S, board.clock())  # a step that took too long is not made up for
        left_s = LOOK_S
        while left_s > 0:
            left_s = due_s - board.clock()
            try:
                zones = board.latest(max(left_s, LOOK_S))  # however late it is, what came is looked at
            except contactfpga.ReadTimeout:
                break
            heard_s = board.clock() if zones.arrived_s is None else zones.arrived_s
            if reason := why_stop(zones):
                return Stop(reason, board.clock(), zones)
        if board.clock() - heard_s > SILENCE_S:
            return Stop("silence", board.clock(), None)


def why_stop(zones: contactfpga.Zones) -> str:
    """What a frame says against going on; "" where nothing does."""
    if "mismatch" in zones.flags or zones.faults:
        return "fault"
    # With `motion`, a row read touched as the frame began: what touched it was gone before its cells were read.
    return "contact" if zones.pressed or "motion" in zones.flags else ""


def main() -> int:
    """Wait for a touch, and say what stopped the loop."""
    steps = 0

    def step() -> None:
        nonlocal steps
        steps += 1  # in its place: read the joints, command the motors

    def brake() -> None:
        print("brake")  # in its place: brake the motors

    try:
        with contactfpga.open(sys.argv[1] if len(sys.argv) > 1 else None) as board:
            stop = guard(board, step, brake)
    except KeyboardInterrupt:
        print(f"stopped after {steps} steps: Ctrl-C")
        return 130
    print(f"stopped after {steps} steps: {stop.reason}")
    if stop.zones or stop.error:
        print(stop.zones or stop.error)
    return 0


if __name__ == "__main__":
    signal.signal(signal.SIGTERM, signal.default_int_handler)  # it brakes, too, and does not just end
    sys.exit(main())
