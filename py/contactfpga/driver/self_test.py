"""Asking a board for its self-test, and gathering the slots of it."""

from __future__ import annotations

from contactfpga.driver.link import Link
from contactfpga.driver.told import Told
from contactfpga.errors import ContactFPGAError, ReadTimeout
from contactfpga.skin.derived import SELF_TEST
from contactfpga.wire.command import Command
from contactfpga.wire.faults import SelfTestSlot
from contactfpga.zones.run import Run
from contactfpga.zones.zone import Zones

ATTEMPT_S = 0.5
"""After which a self-test of which slots were lost is asked for again; more where a slow line needs it."""
SLOT_BITS = 5000
"""On the wire from one slot to the next, at most: the slot, a frame and now and then a hello."""


class _Slots:
    """A listener that waits for all slots of one test."""

    all_events = True

    def __init__(self, count: int):
        self.whole: tuple[SelfTestSlot, ...] | None = None
        self.count = count
        self.attempt_s = ATTEMPT_S
        self._so_far: list[SelfTestSlot] = []

    def put(self, item: Zones | Run | Told | ContactFPGAError) -> None:
        if not isinstance(item, SelfTestSlot):
            return
        if item.number == 0 or item.number != len(self._so_far):
            self._so_far = []
        if item.number == len(self._so_far):
            self._so_far.append(item)
        if len(self._so_far) == self.count:
            self.whole = tuple(self._so_far)

    def look(self) -> bool | None:
        """Whether all have come."""
        return True if self.whole is not None else None


def run(link: Link, timeout: float) -> tuple[SelfTestSlot, ...]:
    """All slots of a test that begins after this call. Raises :class:`ReadTimeout`, and as a command does."""
    deadline = link.clock() + timeout
    while True:
        slots = _listen(link)
        try:
            link.command(Command(SELF_TEST), max(1e-3, deadline - link.clock()))
            link.wait_for(slots.look, min(deadline, link.clock() + slots.attempt_s), timeout)
        except ReadTimeout as error:
            if link.clock() >= deadline:
                raise ReadTimeout(f"{error}; the self-test was not heard as a whole") from None
        finally:
            with link.changed:
                link.listeners.discard(slots)
        if slots.whole is not None:
            return slots.whole


def _listen(link: Link) -> _Slots:
    with link.changed:
        hello = link.conversation.hello
        if hello is None:
            raise ContactFPGAError(f"{link.transport.name}: no hello has come yet")
        slots = _Slots(1 + hello.sheet.rows + hello.sheet.columns)
        slots.attempt_s = max(ATTEMPT_S, slots.count * SLOT_BITS / hello.baud)
        link.listeners.add(slots)
    return slots
