"""The run without a flip, with many entry points."""

from __future__ import annotations

import copy
import dataclasses
import functools
import random
from typing import NamedTuple

import numpy as np

from contactfpga.driver.conversation import Conversation, frames_in
from contactfpga.errors import SkinMismatch, VersionMismatch
from contactfpga.skin import Skin
from contactfpga.wire import framing
from contactfpga.zones.zone import Zones
from contactfpga_sim.lab.flips import touches
from contactfpga_sim.model.board.state import Checkpoint, StateBoard

CLOCK_HZ, BAUD = 5_000_000, 1_250_000
"""Five twelfths of the reference Skin's clock and line: as many frames in fewer clocks."""

FIRST_S, LAST_S = 0.1, 0.6
"""Range of flip times; a hello follows each."""
AFTER_S = 0.5


class DeliveredFrame(NamedTuple):
    time_s: float
    said: touches.Said
    late_s: float
    flagged: bool
    restarts: int = 0
    """Board restarts by the driver's count; each restarts board time."""


@dataclasses.dataclass
class Listener:
    """The host during a flip."""

    conversation: Conversation
    rest: bytes = b""
    surprises: int = 0
    """Hellos of another Skin."""

    @classmethod
    def new(cls, skin: Skin) -> Listener:
        return cls(Conversation("the board", expected=skin, rng=random.Random(1)))

    def hear(self, events: np.ndarray, clock_hz: int) -> list[DeliveredFrame]:
        """Feed bytes as they arrive; delimiters deliver packets."""
        data = events["data"].astype(np.uint8)
        ends = np.flatnonzero(data == framing.DELIMITER) + 1
        found: list[DeliveredFrame] = []
        for start, end in zip([0, *ends], [*ends, len(data)]):
            if start == end:
                continue
            now = int(events["cycle"][end - 1]) / clock_hz
            said = self.conversation.receive(data[start:end].tobytes(), now)
            found += [_heard(zones, now, self.conversation.stats.restarts) for zones in frames_in(said)]
            self.surprises += sum(isinstance(event, SkinMismatch | VersionMismatch) for event in said)
        return found


def _heard(zones: Zones, now: float, restarts: int) -> DeliveredFrame:
    assert zones.time_us is not None
    # The touches of the study jump, and the host says so.
    flagged = bool(zones.flags - {"motion"} or zones.faults)
    return DeliveredFrame(now, touches.said(zones), now - zones.time_us / 1e6, flagged, restarts)


class Step(NamedTuple):
    """The beginning of one sheet state."""

    moment: Checkpoint
    listener: Listener
    events: np.ndarray
    heard: list[DeliveredFrame]


class Reference:
    """A Skin's board with moving touches, from power-up until the last flip is over. Each instance has its own
    ``board`` for flips."""

    def __init__(self, skin: Skin):
        self.skin = skin
        self.step_clocks = round(touches.STEP_S * skin.clock_hz)
        self.sheets = touches.sheets(skin, 2 + round((LAST_S + AFTER_S) / touches.STEP_S))
        self.board = StateBoard(skin)
        self.steps: list[Step] = []
        listener = Listener.new(skin)
        for cells in self.sheets:
            self.board.press(cells)
            moment, before = self.board.moment(), copy.deepcopy(listener)
            self.board.run(self.step_clocks)
            events = self.board.take("received")
            self.steps.append(Step(moment, before, events, listener.hear(events, skin.clock_hz)))
        first = round(FIRST_S / touches.STEP_S)
        late = [heard.late_s for step in self.steps[first:] for heard in step.heard]
        self.late_s = min(late), max(late)

    @functools.cached_property
    def truth(self) -> touches.TruthWindow:
        return touches.TruthWindow(self.skin, self.sheets)

    @property
    def slack_s(self) -> float:
        """Allowed shift at another scan phase: two scans and a hello."""
        return self.late_s[1] - self.late_s[0] + 0.5e-3

    def close(self) -> None:
        self.board.close()
