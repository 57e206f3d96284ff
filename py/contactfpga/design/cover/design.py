"""The algorithm of the paper's Fig. 3: material, thickness, force and pitch under limits, and the binding limit.

Candidates are each foam and the modulus with exactly the required compression time, also those that break a limit.
"""

from __future__ import annotations

import dataclasses
import math

import numpy as np

from contactfpga.design.cover import arm, elastic, impact, sense
from contactfpga.design.cover.answer import NoSolution
from contactfpga.design.cover.foams import Foam
from contactfpga.design.cover.hertz import Ball
from contactfpga.design.cover.impact import Impact
from contactfpga.design.cover.region import Pressing, RegionLimits, limits_of
from contactfpga.design.cover.sense import PaddedSheet, Sense
from contactfpga.design.cover.task import Task
from contactfpga.skin.latency import latency_s

FREE = "free modulus"
"""Candidate whose modulus follows from the time."""

STEPS = 6


@dataclasses.dataclass(frozen=True)
class Check:
    """A limit and the compared value, in SI units."""

    name: str
    value: float
    limit: float
    at_most: bool
    relax: str
    """The necessary relaxation, with a sufficient value."""

    @property
    def used(self) -> float:
        """Used share of the limit; above 1 it is broken."""
        value, limit = (self.value, self.limit) if self.at_most else (self.limit, self.value)
        return value / limit if limit else math.inf

    @property
    def holds(self) -> bool:
        return self.used <= 1


@dataclasses.dataclass(frozen=True)
class FoamDesign:
    """A foam and its results; None for those not reached."""

    foam: Foam
    hit: Impact | None = None
    by_energy_m: dict[str, float] | None = None
    """Thickness (8) by each rule; None if the foam's yield strength is unknown."""
    thickness_m: float | None = None
    """Chosen thickness of the cover."""
    mass_kg_m2: float | None = None
    """Mass of the cover per area; None if the foam's density is unknown."""
    least: Sense | None = None
    """Force that closes a switch right below."""
    pitch_m: float | None = None
    sure: Sense | None = None
    """Force that is felt everywhere at this pitch."""
    regions: tuple[RegionLimits, ...] = ()
    """Speed and reaction time for the task's body regions."""
    checks: tuple[Check, ...] = ()
    no_solution: str | None = None
    notes: tuple[str, ...] = ()

    @property
    def fits(self) -> bool:
        return self.no_solution is None and all(check.holds for check in self.checks)

    @property
    def binding(self) -> Check | None:
        """The limit with the largest used share."""
        return max(self.checks, key=lambda check: check.used, default=None)


@dataclasses.dataclass(frozen=True)
class Thin:
    """A cover for a reaction after ``latency_s``."""

    latency_s: float
    modulus_pa: float | None
    """Free modulus with the task's ratio of compression time to latency."""
    compression_m: float | None
    force_n: float | None
    """Peak force of this modulus."""
    by_energy_m: float | None
    """Thickness (8) of the chosen foam, in proportion to t0/t_c."""
    pressed_m: float | None
    """Indentation of the chosen foam after ``latency_s``."""
    stopped_m: float | None
    """Final indentation if the motor then brakes; the foam must be thicker."""


@dataclasses.dataclass(frozen=True)
class Design:
    """All candidates: fitting ones first, by mass, then thickness."""

    candidates: tuple[FoamDesign, ...]
    thinning: tuple[Thin, ...]
    sheet_s: float
    """Worst latency of the task's sheet, without host and motor."""

    @property
    def best(self) -> FoamDesign | None:
        """The first fitting candidate; None if nothing fits."""
        first = self.candidates[0]
        return first if first.fits else None

    @property
    def relax(self) -> tuple[str, ...]:
        """Necessary relaxations of the nearest candidate; none if one fits."""
        first = self.candidates[0]
        if first.fits:
            return ()
        if first.no_solution:
            return (first.no_solution,)
        return tuple(check.relax for check in first.checks if not check.holds)


def design(task: Task) -> Design:
    """The whole algorithm."""
    tried = [_judge(task, foam, None) for foam in task.foams]
    if task.free:
        tried.append(_free(task))
    tried.sort(key=_rank)
    sheet = latency_s(task.skin)
    return Design(tuple(tried), thinning(task, tried[0].foam if tried[0].hit else None), sheet)


def thinning(task: Task, foam: Foam | None) -> tuple[Thin, ...]:
    """Thinnest covers as t0 falls from the task's to that of sheet, host and motor."""
    lowest = min(task.latency_s, latency_s(task.skin) + task.other_s)
    return tuple(_thin(task, foam, float(t0)) for t0 in np.geomspace(task.latency_s, lowest, STEPS))


def _rank(candidate: FoamDesign) -> tuple[bool, bool, float, float]:
    """Ranking key: fitting candidates by mass, if known, and thickness; others by excess."""
    if candidate.fits:
        mass = candidate.mass_kg_m2
        return False, mass is None, mass or 0.0, candidate.thickness_m or 0.0
    broken = [check.used for check in candidate.checks if not check.holds]
    return True, candidate.no_solution is not None, len(broken), max(broken, default=0.0)


def _free(task: Task) -> FoamDesign:
    found = impact.stiffness_for(task.arm, task.speed_m_s, task.time_s)
    if isinstance(found, NoSolution):
        return FoamDesign(Foam(FREE, 1.0, "no modulus gives the time"), no_solution=found.reason)
    modulus = elastic.young_pa(elastic.ball_of(found.stiffness, task.radius_m).modulus_pa, task.poisson)
    return _judge(task, Foam(FREE, modulus, f"follows from a compression of {1e3 * task.time_s:g} ms"), found)


def _judge(task: Task, foam: Foam, hit: Impact | None) -> FoamDesign:
    ball = _ball(task, foam)
    found = hit or impact.strike(task.arm, task.speed_m_s, elastic.stiffness(ball))
    if isinstance(found, NoSolution):
        return FoamDesign(foam, no_solution=found.reason)
    strain = task.strain or foam.strain
    checks = [
        # The free modulus takes exactly that long, but for the last digits.
        Check("time", found.time_s * (1 + 1e-12), task.time_s, False, f"time_s at most {found.time_s:.4g} s")
    ]
    if task.peak_n is not None:
        checks.append(Check("peak", found.force_n, task.peak_n, True, f"peak_n at least {found.force_n:.4g} N"))
    needed, by_energy = found.compression_m / strain, None
    if foam.yield_pa is not None:
        by_energy = _by_energy(task, foam, ball, found)
        needed = max(needed, by_energy[task.rule])
        limit = elastic.yield_indentation_m(ball, foam.yield_pa)
        checks.append(
            Check(
                "yield",
                found.compression_m,
                limit,
                True,
                f"a lower speed_m_s, or a foam that yields only beyond {found.compression_m:.4g} m",
            )
        )
    thickness = next((plate for plate in task.plates_m if plate >= needed), needed)
    checks.append(Check("thickness", thickness, task.thickness_m, True, f"thickness_m at least {thickness:.4g} m"))
    mass = None if foam.density_kg_m3 is None else foam.density_kg_m3 * thickness
    if mass is not None and task.mass_kg_m2 is not None:
        checks.append(Check("mass", mass, task.mass_kg_m2, True, f"mass_kg_m2 at least {mass:.4g} kg/m2"))
    regions = tuple(_regions(task, ball, strain * thickness))
    checks += [_region_check(task, one) for one in regions]
    notes = ("no plate is as thick as that",) if task.plates_m and thickness not in task.plates_m else ()
    sheet = PaddedSheet(task.switch, thickness, ball if task.contact == "patch" else None)
    sofar = FoamDesign(foam, found, by_energy, thickness, mass, regions=regions, checks=tuple(checks), notes=notes)
    return _sensed(task, sofar, sheet, ball)


def _regions(task: Task, ball: Ball, deepest_m: float) -> list[RegionLimits]:
    """Limits of body regions; a pull back counts only after the reaction."""
    brake = task.brake_nm / task.arm.lever_m
    pressing = Pressing(task.arm.mass_kg, max(0.0, task.arm.push_n(0.0)), brake, ball, deepest_m)
    return [limits_of(pressing, region, task.speed_m_s, task.latency_s) for region in task.regions]


def _region_check(task: Task, one: RegionLimits) -> Check:
    relax = f"speed_m_s at most {one.speed_m_s:.4g} m/s by its {one.binding} limits"
    if 0 < one.reaction_s < task.latency_s:
        relax += f", or latency_s at most {one.reaction_s:.4g} s for those where it is clamped"
    return Check(one.region.name, task.speed_m_s, one.speed_m_s, True, f"{one.region.name}: {relax}")


def _sensed(task: Task, sofar: FoamDesign, sheet: PaddedSheet, ball: Ball) -> FoamDesign:
    checks = list(sofar.checks)
    least = sheet.detects(0.0, task.model, _tolerance(task))
    notes = [*sofar.notes, *(sofar.hit.notes if sofar.hit else ()), *least.notes]
    if sofar.hit and ball.patch_m(sofar.hit.force_n) > sheet.thickness_m:
        notes.append("Hertz stops holding in the impact: its patch is wider than the foam is thick")
    pitch, sure = None, None
    if isinstance(least.value, NoSolution):
        return dataclasses.replace(sofar, least=least, no_solution=least.value.reason, notes=tuple(notes))
    checks.append(
        Check("force", least.value, task.force_n, True, f"force_n at least {least.value:.4g} N, or a thinner cover")
    )
    if least.value <= task.force_n:
        reach = sheet.reaches(task.force_n, task.model, _tolerance(task))
        if not isinstance(reach.value, NoSolution):
            pitch = min(task.pitch_m, sense.pitch_m(reach.value))
            sure = sheet.detects(sense.worst_offset_m(pitch), task.model, _tolerance(task)) if pitch > 0 else None
    if task.pitch_min_m is not None and pitch is not None:
        wanted = sheet.detects(sense.worst_offset_m(task.pitch_min_m), task.model, _tolerance(task)).value
        force = "no force does" if isinstance(wanted, NoSolution) else f"force_n at least {wanted:.4g} N"
        checks.append(Check("pitch", pitch, task.pitch_min_m, False, f"pitch_min_m at most {pitch:.4g} m, or {force}"))
    return dataclasses.replace(
        sofar, least=least, pitch_m=pitch, sure=sure, checks=tuple(checks), notes=tuple(dict.fromkeys(notes))
    )


def _by_energy(task: Task, foam: Foam, ball: Ball, hit: Impact, t0: float | None = None) -> dict[str, float]:
    """Thickness (8) by each rule, with the link's mass as printed, else with the effective mass at the contact."""
    assert foam.yield_pa is not None
    stored = elastic.resilience(foam.yield_pa, foam.modulus_pa)
    share = min(1.0, (task.latency_s if t0 is None else t0) / hit.time_s)
    return {
        rule: elastic.thickness_m(
            ball, task.mass_kg if rule == "printed" else task.arm.mass_kg, task.speed_m_s, stored, share, rule
        )
        for rule in elastic.THICKNESS_RULES
    }


def _thin(task: Task, foam: Foam | None, t0: float) -> Thin:
    found = impact.stiffness_for(task.arm, task.speed_m_s, t0 * task.time_s / task.latency_s)
    modulus = depth = force = by_energy = pressed = stopped = None
    if isinstance(found, Impact):
        stiff = elastic.ball_of(found.stiffness, task.radius_m)
        modulus = elastic.young_pa(stiff.modulus_pa, task.poisson)
        depth, force = found.compression_m, found.force_n
    if foam is not None and foam.name != FREE:
        ball = _ball(task, foam)
        hit = impact.strike(task.arm, task.speed_m_s, elastic.stiffness(ball))
        if isinstance(hit, Impact):
            if foam.yield_pa is not None:
                by_energy = _by_energy(task, foam, ball, hit, t0)[task.rule]
            pressed = _pressed_m(task, hit, t0)
            stopped = _stopped_m(task, hit, pressed)
    return Thin(t0, modulus, depth, force, by_energy, pressed, stopped)


def _pressed_m(task: Task, hit: Impact, seconds: float) -> float:
    if seconds >= hit.time_s:
        return hit.compression_m
    course = arm.course(task.arm, task.speed_m_s, hit.stiffness, hit.compression_m, 256)
    half = len(course.time_s) // 2 + 1
    return float(np.interp(seconds, course.time_s[:half], course.indentation_m[:half]))


def _stopped_m(task: Task, hit: Impact, pressed_m: float) -> float:
    if pressed_m >= hit.compression_m:
        return hit.compression_m
    braking = dataclasses.replace(task.arm, torque_nm=-task.brake_nm)
    kept = 2 * (task.arm.torque_nm + task.brake_nm) * pressed_m / task.arm.lever_m / task.arm.mass_kg
    return impact.compression_m(braking, math.sqrt(task.speed_m_s**2 + kept), hit.stiffness)


def _tolerance(task: Task) -> float | None:
    return task.tolerance if task.model is None else None


def _ball(task: Task, foam: Foam) -> Ball:
    return Ball(task.radius_m, elastic.effective_modulus_pa(foam.modulus_pa, task.poisson))


def margin(check: Check) -> str:
    """Used share of a limit, in words."""
    return "broken" if not check.holds else f"{100 * min(1.0, check.used):.0f} % used"
