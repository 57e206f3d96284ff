"""The smallest force that a sheet under a cover detects, and the pitch it needs, by the simplest adequate model.

A model is a medium (:mod:`contactfpga.design.cover.medium`) and a contact, ``point`` or ``patch`` (a ball's Hertz
pressure). The reference is the bonded layer, under the patch of a round object or the point force of an unknown one.
"""

from __future__ import annotations

import dataclasses
import functools
import math
from collections.abc import Callable
from typing import NamedTuple

from contactfpga.design.cover import hertz_layer, medium, point
from contactfpga.design.cover.answer import CoverError, NoSolution, positive
from contactfpga.design.cover.hertz import Ball
from contactfpga.design.cover.point import Switch

TOLERANCE = 0.05
"""Default tolerance of the simplest model's answer against the reference's."""

CONTACTS = ("point", "patch")


class Model(NamedTuple):
    """A medium and a contact."""

    within: str
    """``halfspace``, ``bonded`` or ``frictionless``."""
    contact: str
    """``point`` or ``patch``."""

    def __str__(self) -> str:
        return f"{self.within}, {self.contact}"


LADDER = (
    Model("halfspace", "point"),
    Model("bonded", "point"),
    Model("halfspace", "patch"),
    Model("bonded", "patch"),
)
"""Models, simplest first; the last is the reference."""


@dataclasses.dataclass(frozen=True)
class Sense:
    """An answer and its accuracy."""

    value: float | NoSolution
    """A force in N or a reach in m."""
    model: Model
    reference: float | NoSolution
    """The reference's answer."""
    error: float | None
    """``value`` over ``reference`` minus 1; None if one is no number."""
    dropped: tuple[str, ...]
    """Effects in the reference that this model omits."""
    notes: tuple[str, ...]
    """Limits of the model's validity."""


@dataclasses.dataclass(frozen=True)
class PaddedSheet:
    """Foam over switches, and the touching object."""

    switch: Switch
    thickness_m: float
    """Thickness of the foam."""
    ball: Ball | None = None
    """The touching object; None: unknown, a point force."""

    def __post_init__(self) -> None:
        positive("thickness_m", self.thickness_m, "m")

    @property
    def reference(self) -> Model:
        return LADDER[-1] if self.ball else Model("bonded", "point")

    def force_n(self, model: Model, offset_m: float) -> float | NoSolution:
        """Least force that closes a switch ``offset_m`` from the contact's middle, (9) solved for F."""
        if model.contact not in CONTACTS:
            raise CoverError(f"contact is {model.contact!r}; it must be one of {', '.join(CONTACTS)}")
        if model.contact == "point":
            return point.force_n(self.switch, offset_m, self.thickness_m, model.within)
        ball = self._ball(model)
        force = hertz_layer.closing_n(ball, self.switch, offset_m, self.thickness_m, model.within)
        limit = medium.first_zero(model.within)
        if isinstance(force, NoSolution) or limit is None or offset_m < limit * self.thickness_m:
            return force
        if ball.patch_m(force) > self.thickness_m:
            return NoSolution(
                f"a switch {1e3 * offset_m:.4g} mm away is {offset_m / self.thickness_m:.4g} thicknesses away; from "
                f"{limit:.4g} on a point force on a {model.within} layer does not press it, and a patch that would is "
                "wider than the foam is thick"
            )
        return force

    def reach_m(self, model: Model, force_n: float) -> float | NoSolution:
        """Distance from the contact's middle up to which a switch closes; inverse of :meth:`force_n`."""
        if model.contact == "point":
            return point.reach_m(self.switch, force_n, self.thickness_m, model.within)
        return hertz_layer.reach_m(self._ball(model), self.switch, force_n, self.thickness_m, model.within)

    def detects(self, offset_m: float, model: Model | None = None, tolerance: float | None = None) -> Sense:
        """:meth:`force_n` by a named model, or by the simplest within ``tolerance`` of the reference.

        The default tolerance is :data:`TOLERANCE`. A named model that is off by more is refused only with
        ``tolerance``, else it answers with a note of its error.
        """
        found = self._judge(lambda one: self.force_n(one, offset_m), model, tolerance)
        force = found.reference if isinstance(found.value, NoSolution) else found.value
        return self._noted(found, None if isinstance(force, NoSolution) else force)

    def reaches(self, force_n: float, model: Model | None = None, tolerance: float | None = None) -> Sense:
        """:meth:`reach_m` by a named or the simplest adequate model, as in :meth:`detects`."""
        return self._noted(self._judge(lambda one: self.reach_m(one, force_n), model, tolerance), force_n)

    def _ball(self, model: Model) -> Ball:
        if self.ball is None:
            raise CoverError(f"model is '{model}'; a patch needs the radius R* and the modulus E* of the contact")
        return self.ball

    def _judge(self, ask: Callable[[Model], float | NoSolution], model: Model | None, tolerance: float | None) -> Sense:
        if tolerance is not None:
            positive("tolerance", tolerance, "")
        reference = ask(self.reference)
        if model is not None:
            found = self._sense(ask(model), model, reference)
            return found if tolerance is None else self._refused(found, tolerance)
        for one in LADDER:
            if one == self.reference:
                break
            if one.contact == "patch" and self.ball is None:
                continue
            found = self._sense(ask(one), one, reference)
            if found.error is not None and abs(found.error) <= (tolerance or TOLERANCE):
                return found
        return self._sense(reference, self.reference, reference)

    def _sense(self, value: float | NoSolution, model: Model, reference: float | NoSolution) -> Sense:
        error = None
        if not isinstance(value, NoSolution) and not isinstance(reference, NoSolution):
            error = 0.0 if value == reference else value / reference - 1 if reference else math.inf
        dropped = []
        if model.within == "halfspace":
            dropped.append("the rigid base")
        if model.contact == "point" and self.ball is not None:
            dropped.append("the width of the contact")
        return Sense(value, model, reference, error, tuple(dropped), ())

    def _refused(self, found: Sense, tolerance: float) -> Sense:
        if isinstance(found.value, NoSolution) or (found.error is not None and abs(found.error) <= tolerance):
            return found
        off = "has an answer" if found.error is None else f"is off by {100 * found.error:+.0f} %"
        other = found.reference if isinstance(found.reference, NoSolution) else f"take '{self.reference}'"
        reason = f"'{found.model}' {off}, {100 * tolerance:g} % are asked for; {other}"
        return dataclasses.replace(found, value=NoSolution(reason))

    def _noted(self, found: Sense, force_n: float | None) -> Sense:
        notes = []
        if self.ball is None:
            notes.append("what touches is not known: a point force is taken")
        elif force_n is not None and self.ball.patch_m(force_n) > self.thickness_m:
            radius = f"{1e3 * self.ball.patch_m(force_n):.4g} mm"
            notes.append(
                f"Hertz stops holding: at {force_n:.4g} N the patch has a radius of {radius}, the foam is "
                f"{1e3 * self.thickness_m:.4g} mm thick"
            )
        if found.error is not None and abs(found.error) > TOLERANCE:
            notes.append(f"'{found.model}' is off by {100 * found.error:+.0f} % from '{self.reference}'")
        elif isinstance(found.reference, NoSolution) and not isinstance(found.value, NoSolution):
            notes.append(f"'{self.reference}' has {found.reference}")
        return dataclasses.replace(found, notes=tuple(notes))


def worst_offset_m(pitch_x_m: float, pitch_y_m: float | None = None) -> float:
    """The largest distance of a point from a switch: half the diagonal of a cell."""
    wide = positive("pitch_x_m", pitch_x_m, "m")
    return math.hypot(wide, wide if pitch_y_m is None else positive("pitch_y_m", pitch_y_m, "m")) / 2


def pitch_m(reach_m: float) -> float:
    """Pitch of a square matrix whose worst place is ``reach_m`` from a switch: sqrt(2) times it (paper, IV.C)."""
    return math.sqrt(2) * reach_m


@functools.cache
def best_ratio(within: str = "halfspace") -> float:
    """Offset over thickness with the least closing force at a given offset: sqrt(2/3) in a half-space. F = sigma
    rho^2/(s^2 g(s)), s = rho/h."""
    if within == "halfspace":
        return math.sqrt(2 / 3)

    def yields(s: float) -> float:
        return s * s * float(medium.exact_spread(within, s))

    low, high = 0.1, medium.first_zero(within) or 2.0
    share = (math.sqrt(5) - 1) / 2
    while high - low > 1e-9:  # a maximum is known to half the digits of its height
        left, right = high - share * (high - low), low + share * (high - low)
        low, high = (low, right) if yields(left) > yields(right) else (left, high)
    return (low + high) / 2


def best_thickness_m(offset_m: float, within: str = "halfspace") -> float:
    """Thickness with the least point force for a switch at ``offset_m``: sqrt(1.5) rho in a half-space."""
    return positive("offset_m", offset_m, "m") / best_ratio(within)
