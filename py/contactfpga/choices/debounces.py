"""Debounces: conditions for a switch to change its state; methods and names as in QMK."""

from __future__ import annotations

import dataclasses
from typing import Any, Literal

from contactfpga.choices.choice import Choice, load
from contactfpga.choices.choice import find as find_choice


@dataclasses.dataclass(frozen=True, kw_only=True)
class Debounce(Choice):
    """A debounce of rows.

    ``gateware`` counts scan periods; ``timed_gateware`` counts us, for scans that wait. ``golden``: a
    :class:`contactfpga_sim.model.golden.debounce.DebounceRule`.
    """

    timed_gateware: str
    delays_press: bool
    """Whether a press counts only after ``debounce_press_us``."""

    def load_timed_gateware(self) -> Any:
        """The gateware's class for scans that wait. Imports Amaranth."""
        return load(self.timed_gateware)


_EVEN, _TIMED = "contactfpga_hdl.debounce.even:Debounce", "contactfpga_hdl.debounce.timed:TimedDebounce"

DebounceName = Literal["none", "sym_defer_pk", "asym_eager_defer_pk"]

DEBOUNCES: dict[str, Debounce] = {
    debounce.name: debounce
    for debounce in (
        Debounce(
            name="none",
            title="not debounced",
            gateware="",
            timed_gateware="",
            golden="contactfpga_sim.model.golden.debounce:NONE",
            delays_press=False,
        ),
        Debounce(
            name="sym_defer_pk",
            title="debounced, deferred",
            gateware=_EVEN,
            timed_gateware=_TIMED,
            golden="contactfpga_sim.model.golden.debounce:SYM_DEFER",
            delays_press=True,
        ),
        Debounce(
            name="asym_eager_defer_pk",
            title="debounced, eager",
            gateware=_EVEN,
            timed_gateware=_TIMED,
            golden="contactfpga_sim.model.golden.debounce:ASYM_EAGER_DEFER",
            delays_press=False,
        ),
    )
}


def find(value: object) -> Debounce:
    return find_choice(Debounce, DEBOUNCES, value)
