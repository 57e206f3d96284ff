"""Active compliance: how far, and how fast at most, the arm yields to a push."""

from __future__ import annotations

import dataclasses

import numpy as np

from contactfpga_sim.lab.arm.case import Case, CaseError
from contactfpga_sim.lab.arm.run import RunRecord, run

BACK_M = 1e-3

FASTEST_M_S = 5.0
"""Upper end of the search for the fastest push."""

SHARES = (0.25, 0.5, 0.75, 1.0, 1.25)


@dataclasses.dataclass(frozen=True)
class Push:
    speed_m_s: float
    peak_torque_nm: float
    peak_force_n: float
    peak_indentation_m: float
    yields_m: float
    back_s: float | None
    """Time from the first touch until the arm is back for good; None: not in this run."""
    stopped: bool


def pushed(case: Case, speed_m_s: float) -> tuple[Push, RunRecord]:
    if case.control.behavior != "comply":
        raise CaseError(f"behavior is {case.control.behavior!r}; a push needs 'comply'")
    touch = dataclasses.replace(case.touch[0], push_m_s=speed_m_s)
    result = run(case.but(touch=(touch, *case.touch[1:])), "torque")
    place = case.link.lever_m * (result.course["angle_rad"] - result.course["angle_rad"][0])
    away = np.flatnonzero(np.abs(place) > BACK_M)
    last = int(away[-1]) if len(away) else 0
    back = float(result.course["time_s"][last + 1]) if last + 1 < len(place) else None
    outcome = result.outcome
    push = Push(
        speed_m_s=speed_m_s,
        peak_torque_nm=outcome.peak_torque_nm,
        peak_force_n=outcome.peak_force_n,
        peak_indentation_m=outcome.peak_indentation_m,
        yields_m=float(-place.min()),
        back_s=back if not result.events else None,
        stopped=bool(result.events),
    )
    return push, result


def fastest_m_s(case: Case, resolution: float = 0.005) -> float:
    """The fastest push, rounded down to ``resolution`` in m/s, with torque below the limit."""

    def holds(steps: int) -> bool:
        speed = steps * resolution
        short = case.but(run={"duration_s": case.touch[0].push_m / speed + case.touch[0].hold_s})
        return pushed(short, speed)[0].peak_torque_nm < case.control.torque_limit_nm

    low, high = 0, round(FASTEST_M_S / resolution)
    while high - low > 1:
        middle = (low + high) // 2
        low, high = (middle, high) if holds(middle) else (low, middle)
    return low * resolution


def pushes(case: Case) -> tuple[float, list[Push]]:
    """The fastest push in m/s, and results up to it and beyond."""
    fastest = fastest_m_s(case)
    return fastest, [pushed(case, share * fastest)[0] for share in SHARES]
