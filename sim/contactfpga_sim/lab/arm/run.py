"""One run from power-up to rest."""

from __future__ import annotations

import dataclasses

import numpy as np

from contactfpga.driver import driver
from contactfpga.errors import ReadTimeout
from contactfpga.skin import Skin
from contactfpga_sim.lab.arm.case import Case, CaseError
from contactfpga_sim.lab.arm.world import PINS, UNITS, WAYS, CourseStep, Faults, World


class PlantTransport:
    """A :class:`contactfpga.driver.transport.Transport` that advances arm and gateware while the driver waits."""

    live, threaded = True, False
    name = "arm://"

    def __init__(self, world: World):
        self._world = world

    def read(self, timeout_s: float) -> bytes:
        until = self._world.clock() + timeout_s
        while not (data := self._world.delivered()) and self._world.clock() < until:
            self._world.step()
        return data

    def write(self, data: bytes) -> None:
        self._world.send(data)

    def clock(self) -> float:
        return self._world.clock()

    def close(self) -> None:
        pass


AFTER_S = 0.25e-3
"""Delay of the second torque reading after the reaction."""

SLOW_M_S = 1e-3

WITH_UNITS = Skin(units=3, unit_sums=((1, 1, 1),), baud=6_000_000)
"""The reference Skin on three pressure units."""

STAY_S = 20e-3


@dataclasses.dataclass(frozen=True)
class ArmResponse:
    """Times in s from the touch; None: it did not happen. The reaction is the first controller sample that reverses
    or stops the arm."""

    closes_s: float | None
    detected_s: float | None
    """Arrival of the contact at the controller's input."""
    detected_m: float | None
    """Indentation at that time."""
    reacts_s: float | None
    reason: str
    """Reason: ``contact``, ``torque``, ``silence``, or none."""
    positive_s: float | None
    """Time from the reaction until the arm goes back."""
    torque_before_nm: float | None
    torque_after_nm: float | None
    """True torque :data:`AFTER_S` after the reaction."""
    force_before_n: float | None
    peak_force_n: float
    peak_torque_nm: float
    peak_indentation_m: float
    bottomed: bool
    resolved_s: float | None
    """Time from which switches stay open."""
    rest_s: float | None
    reversals: int
    zones: int
    """Most zones that the host reported at once."""


@dataclasses.dataclass(frozen=True)
class RunRecord:
    outcome: ArmResponse
    course: np.ndarray
    """Structured array of a :class:`contactfpga_sim.lab.arm.world.CourseStep` per step."""
    events: tuple[tuple[float, str, str], ...]
    """Controller events: (time in s, new state, reason)."""
    heard: tuple[tuple[float, int], ...]
    """Reports of the host: (time in s, zones)."""


def run(
    case: Case,
    way: str = "uart",
    *,
    latency_s: float = 6e-3,
    skin: Skin | None = None,
    faults: Faults | None = None,
    sheet: int = 0,
    to_peak: bool = False,
) -> RunRecord:
    """Let the arm run into the touched things.

    ``way``: one of :data:`contactfpga_sim.lab.arm.world.WAYS`; ``latency_s``: for the way ``latency``; ``skin``: by
    default the reference Skin, with units if needed; ``sheet``: seed of its closing forces; ``to_peak``: end once the
    force has fallen to half its peak after the reaction. All ways but ``latency`` and ``torque`` compile the Skin's
    gateware.
    """
    if way not in WAYS:
        raise CaseError(f"way is {way!r}; it must be one of {', '.join(WAYS)}")
    skin = skin or (WITH_UNITS if way in UNITS else Skin())
    if way in UNITS and not (skin.units == 3 and skin.unit_sums and set(skin.unit_sums[0]) == {1}):
        raise CaseError(f"units is {skin.units}; the way {way!r} needs units = 3, and unit_sums with [1, 1, 1] first")
    cycles = case.run.step_s * skin.clock_hz
    if way in (*PINS, "uart") and abs(cycles - round(cycles)) > 1e-6:
        raise CaseError(f"step_s is {case.run.step_s:g}; it must be a whole number of clocks of {skin.clock_hz} Hz")
    _on_sheet(case, skin)
    if way == "uart" and skin.send == "on_change" and 1e-3 * skin.keep_alive_ms >= case.control.watchdog_s:
        raise CaseError(
            f"keep_alive_ms is {skin.keep_alive_ms:g}; without a frame the controller stops the arm after "
            f"{case.control.watchdog_s:g} s"
        )
    world = World(case, way, skin, latency_s, faults, sheet)
    try:
        if way == "uart":
            _host(world)
        while not _over(world) and not (to_peak and _past_peak(world)):
            world.step()
    finally:
        world.close()
    return RunRecord(_outcome(world), _array(world.course), tuple(world.controller.events), tuple(world.heard))


def _on_sheet(case: Case, skin: Skin) -> None:
    ends = (("x_mm", (skin.columns - 0.5) * skin.pitch_x_mm), ("y_mm", (skin.rows - 0.5) * skin.pitch_y_mm))
    for touch in case.touch:
        for name, end in ends:
            if getattr(touch, name) > end:
                raise CaseError(f"{name} of a touch is {getattr(touch, name):g}; the sheet ends at {end:g} mm")


def _host(world: World) -> None:
    with driver.Board(PlantTransport(world)) as board:
        board.greet(world.case.run.lead_s)
        while not _over(world) and not _host_dead(world):
            try:
                world.say(len(board.next(world.case.control.period_s)))
            except ReadTimeout:
                continue


def _host_dead(world: World) -> bool:
    return world.faults.host_dies_s is not None and world.time_s >= world.faults.host_dies_s


def _over(world: World) -> bool:
    if world.time_s >= world.case.run.duration_s:
        return True
    events = world.controller.events
    resting = bool(events) and events[-1][1] in ("resting", "stopped")
    return resting and world.time_s - events[-1][0] > STAY_S and _slow(world, world.course[-1])


def _past_peak(world: World) -> bool:
    """On the way back, as a board on a bed of foam may leave a body for a moment before."""
    if not world.controller.events:
        return False
    last = world.course[-1]
    return last.speed_rad_s < 0 and last.force_n < world.peak_n / 2


def _slow(world: World, moment: CourseStep) -> bool:
    return abs(moment.speed_rad_s) * world.case.link.lever_m < SLOW_M_S


def _array(course: list[CourseStep]) -> np.ndarray:
    kinds = [(name, bool if name in ("closed", "contact") else float) for name in CourseStep._fields]
    return np.array(course, dtype=kinds)


def _outcome(world: World) -> ArmResponse:
    course, events, lever = _array(world.course), world.controller.events, world.case.link.lever_m
    time = course["time_s"]
    reactions = [(at, reason) for at, state, reason in events if state in ("reversing", "stopped")]
    reacts, reason = reactions[0] if reactions else (None, "")
    slow = np.abs(course["speed_rad_s"]) * lever < SLOW_M_S
    last_fast = int(np.flatnonzero(~slow)[-1]) if not slow.all() else -1
    closed = np.flatnonzero(course["closed"])
    opened = closed[-1] + 1 if len(closed) and closed[-1] + 1 < len(course) else None
    at = None if reacts is None else int(np.searchsorted(time, reacts - 1e-9))
    after = None if reacts is None else int(np.searchsorted(time, reacts + AFTER_S - 1e-9))
    return ArmResponse(
        closes_s=float(time[closed[0]]) if len(closed) else None,
        detected_s=world.detected_s,
        detected_m=None
        if world.detected_s is None
        else float(np.interp(world.detected_s, time, course["indentation_m"])),
        reacts_s=reacts,
        reason=reason,
        positive_s=_until_back(course, at),
        torque_before_nm=None if at is None else float(course["sensor_nm"][at]),
        torque_after_nm=None if after is None or after >= len(course) else float(course["sensor_nm"][after]),
        force_before_n=None if at is None else float(course["force_n"][at]),
        peak_force_n=float(course["force_n"].max()),
        peak_torque_nm=float(np.abs(course["sensor_nm"]).max()),
        peak_indentation_m=float(course["indentation_m"].max()),
        bottomed=bool(course["indentation_m"].max() > world.deepest_m),
        resolved_s=None if opened is None else float(time[opened]),
        rest_s=float(time[last_fast + 1]) if last_fast + 1 < len(course) else None,
        reversals=sum(state == "reversing" for _, state, _ in events),
        zones=max((zones for _, zones in world.heard), default=0),
    )


def _until_back(course: np.ndarray, start: int | None) -> float | None:
    if start is None:
        return None
    speed, time = course["speed_rad_s"], course["time_s"]
    back = np.flatnonzero(speed[start:] <= 0)
    if not len(back):
        return None
    after = start + int(back[0])
    if after == start:
        return 0.0
    share = speed[after - 1] / (speed[after - 1] - speed[after])
    return float(time[after - 1] + share * (time[after] - time[after - 1]) - time[start])
