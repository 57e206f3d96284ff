"""An arm that runs into an obstacle: depth, duration and peak force of the compression.

Compression ends where v = 0 in the energy balance (3) of :mod:`contactfpga.design.cover.arm`.
"""

from __future__ import annotations

import dataclasses
import math

import numpy as np

from contactfpga.design.cover.answer import SMALLEST, CoverError, NoSolution, not_negative, positive
from contactfpga.design.cover.arm import Arm, compress, slowness, speed2
from contactfpga.design.cover.numerics import integral, root

COMPRESSION_TIME: float = 0.4 * math.gamma(0.4) * math.gamma(0.5) / math.gamma(0.9)
"""t_c v0/delta_c without torque and gravity: (2/5) B(2/5, 1/2) = 1.471637592."""

METHODS = ("auto", "closed", "quadrature", "ode")
"""``auto`` is the closed form if there is one, else quadrature."""

WIDE_ANGLE = 0.1
"""delta/d in rad from which theta - theta0 = delta/d is inaccurate."""


@dataclasses.dataclass(frozen=True)
class Impact:
    """The end of a compression."""

    compression_m: float
    """delta_c."""
    time_s: float
    """t_c, from the touch to the end of the compression."""
    force_n: float
    """Peak force, at the end."""
    stiffness: float
    """K_s in N/m^1.5."""
    energy_j: float
    """Energy in the foam at the end."""
    method: str
    """``closed``, ``quadrature`` or ``ode``."""
    notes: tuple[str, ...] = ()
    """Limits of the model's accuracy."""


def strike(
    arm: Arm,
    speed_m_s: float,
    stiffness: float,
    *,
    method: str = "auto",
    thickness_m: float | None = None,
    yield_m: float | None = None,
) -> Impact | NoSolution:
    """The compression after a touch at ``speed_m_s`` by a contact of ``stiffness`` K_s in N/m^1.5.

    There is no solution if the foam is pressed flat or yields (at ``yield_m``), if nothing presses, or if the arm would
    turn further than its lever.
    """
    _checked(speed_m_s, stiffness)
    if method not in METHODS:
        raise CoverError(f"method is {method!r}; it must be one of {', '.join(METHODS)}")
    if method == "auto":
        method = "closed" if arm.free else "quadrature"
    if method == "closed" and not arm.free:
        raise CoverError("method is 'closed'; with torque or gravity there is no closed form, take 'quadrature'")
    if speed_m_s == 0 and arm.push_n(0.0) <= 0:
        return NoSolution("the arm touches at 0 m/s and neither torque nor gravity presses it on")
    depth = compression_m(arm, speed_m_s, stiffness)
    refused = refusal(arm, stiffness, depth, thickness_m, yield_m)
    if refused:
        return refused
    if method == "closed":
        seconds: float | None = COMPRESSION_TIME * depth / speed_m_s
    elif method == "quadrature":
        seconds = time_s(arm, speed_m_s, stiffness, depth)
    else:
        depth, seconds = compress(arm, speed_m_s, stiffness)
    if seconds is None:
        return NoSolution(f"the arm all but stops on the way to {1e3 * depth:.4g} mm: its time is not determined")
    return _impact(arm, stiffness, depth, seconds, method)


def stiffness_for(
    arm: Arm, speed_m_s: float, seconds: float, *, thickness_m: float | None = None
) -> Impact | NoSolution:
    """The compression that takes ``seconds``, the inverse of :func:`strike`.

    A deeper compression is longer, so the search is over delta_c, for which (5) gives K_s. There is no solution if
    torque and gravity stop the arm sooner, or if the foam would yield by more than the lever or ``thickness_m``.
    """
    positive("speed_m_s", speed_m_s, "m/s")
    if positive("seconds", seconds, "s") < SMALLEST:
        raise CoverError(f"seconds is {seconds:g}; it must be at least {SMALLEST:g} s")
    if arm.free:
        depth = seconds * speed_m_s / COMPRESSION_TIME
        stiff = 1.25 * arm.mass_kg * speed_m_s**2 / depth**2.5
        return refusal(arm, stiff, depth, thickness_m, None) or _impact(arm, stiff, depth, seconds, "closed")
    limit, reason = _deepest(arm, speed_m_s, thickness_m)
    longest = _time_to(arm, speed_m_s, limit)
    if longest is not None and seconds >= longest:
        return NoSolution(f"a compression of {1e3 * seconds:.4g} ms: {reason.format(1e3 * longest)}")
    low = min(limit, seconds * speed_m_s)
    while (_time_to(arm, speed_m_s, low) or math.inf) > seconds:
        low /= 2

    def excess(depth: float) -> float:
        found = _time_to(arm, speed_m_s, depth)
        return (math.inf if found is None else found) - seconds

    depth = root(excess, low, limit)
    stiff = _stiffness_at(arm, speed_m_s, depth)
    return _impact(arm, stiff, depth, seconds, "quadrature")


def compression_m(arm: Arm, speed_m_s: float, stiffness: float) -> float:
    """delta_c, (5): the first indentation at which v is 0.

    Without gravity the balance is concave. With gravity each step goes to the root of a concave lower bound, so no root
    is skipped.
    """
    _checked(speed_m_s, stiffness)
    if arm.free:
        return float((1.25 * arm.mass_kg * speed_m_s**2 / stiffness) ** 0.4)
    depth, curve, spring = 0.0, arm.weight_nm / (2 * arm.lever_m**2), 0.4 * stiffness
    for _ in range(1000):
        left = arm.mass_kg / 2 * float(speed2(arm, speed_m_s, stiffness, depth))
        push = arm.push_n(depth)
        if left <= 0 and depth > 0:
            break

        def below(step: float, at: float = depth, left: float = left, push: float = push) -> float:
            taken: float = spring * ((at + step) ** 2.5 - at**2.5)
            return left + step * (push - curve * step) - taken

        high = (left / spring) ** 0.4 + 1e-300
        if push > 0:
            high += (push / spring) ** (2 / 3)
        low = high
        while low > 0 and below(low) <= 0:
            low /= 2
        if not depth + low > depth:
            break
        while below(high) > 0:
            high *= 2
        step = root(below, low, high)
        if not depth + step > depth * (1 + 1e-16):
            break
        depth += step
        if arm.weight_nm == 0:
            break
    return depth


def _checked(speed_m_s: float, stiffness: float) -> None:
    positive("stiffness", stiffness, "N/m^1.5")
    if 0 < not_negative("speed_m_s", speed_m_s, "m/s") < SMALLEST:
        raise CoverError(f"speed_m_s is {speed_m_s:g}; it must be 0, or at least {SMALLEST:g} m/s")


def time_s(arm: Arm, speed_m_s: float, stiffness: float, depth_m: float) -> float | None:
    """t_c, (4), to about 1e-13; None if not finite.

    With delta = delta_c sin^2(phi) both ends are smooth. In the upper half cos^2(phi) is divided out of v^2
    analytically, so an error of delta_c enters linearly.
    """
    not_negative("speed_m_s", speed_m_s, "m/s")
    not_negative("stiffness", stiffness, "N/m^1.5")
    positive("depth_m", depth_m, "m")
    return integral(lambda phi: slowness(arm, speed_m_s, stiffness, depth_m, phi), 0.0, math.pi / 2)


def _impact(arm: Arm, stiffness: float, depth: float, seconds: float, method: str) -> Impact:
    notes = []
    if depth / arm.lever_m > WIDE_ANGLE:
        notes.append(f"the arm turns by {depth / arm.lever_m:.2g} rad: theta - theta0 = delta/d is rough")
    force, energy = stiffness * depth**1.5, 0.4 * stiffness * depth**2.5
    return Impact(depth, seconds, force, stiffness, energy, method, tuple(notes))


def refusal(
    arm: Arm, stiffness: float, depth: float, thickness_m: float | None, yield_m: float | None
) -> NoSolution | None:
    """Why a compression to ``depth`` m is impossible, as in :func:`strike`; None if possible."""
    limit, what = arm.lever_m, "the lever's length"
    if thickness_m is not None:
        limit, what = positive("thickness_m", thickness_m, "m"), "the foam's thickness"
    if depth >= limit:
        held = max(0.0, arm.push_n(0.0) / stiffness) ** (2 / 3)
        if held >= limit:
            return NoSolution(
                f"the torque wins: without any speed it presses the foam in by {1e3 * held:.4g} mm, {what} is "
                f"{1e3 * limit:.4g} mm"
            )
        if thickness_m is None:
            return NoSolution(
                f"the foam is too soft: it would be pressed in by {1e3 * depth:.4g} mm, {what} is {1e3 * limit:.4g} mm"
            )
        return NoSolution(f"the foam bottoms out: pressed in by {1e3 * depth:.4g} mm, it is {1e3 * limit:.4g} mm thick")
    if yield_m is not None and depth > positive("yield_m", yield_m, "m"):
        return NoSolution(
            f"outside the elastic range: pressed in by {1e3 * depth:.4g} mm, the foam yields from "
            f"{1e3 * yield_m:.4g} mm on"
        )
    return None


def _stiffness_at(arm: Arm, speed_m_s: float, depth: float) -> float:
    """K_s at which the compression ends at ``depth``, (5); negative where the arm does not arrive."""
    energy = arm.mass_kg * speed_m_s**2 / 2 + float(arm.work_j(depth))
    return float(energy / (0.4 * depth**2.5))


def _time_to(arm: Arm, speed_m_s: float, depth: float) -> float | None:
    return time_s(arm, speed_m_s, max(0.0, _stiffness_at(arm, speed_m_s, depth)), depth)


def _deepest(arm: Arm, speed_m_s: float, thickness_m: float | None) -> tuple[float, str]:
    limit = arm.lever_m if thickness_m is None else positive("thickness_m", thickness_m, "m")
    energy = arm.mass_kg * speed_m_s**2 / 2
    grid = np.linspace(0, limit, 257)
    stopped = np.flatnonzero(energy + arm.work_j(grid) <= 0)
    if len(stopped):
        low, high = float(grid[stopped[0] - 1]), float(grid[stopped[0]])
        limit = root(lambda depth: energy + float(arm.work_j(depth)), low, high)
        return limit, "torque and gravity stop the arm within {:.4g} ms whatever the foam"
    what = "the lever's length" if thickness_m is None else "the foam's thickness"
    return limit, f"the foam would be pressed in by more than {what}, {1e3 * limit:.4g} mm; that takes {{:.4g}} ms"
