"""What a case of the arm is made of: link, motor, controller, foam, switches, what is touched, and the host's link."""

from __future__ import annotations

import dataclasses
import functools
import math

from contactfpga.design.cover import Ball, Switch, elastic
from contactfpga.design.cover.answer import LARGEST, SMALLEST, CoverError, not_negative, positive

BEHAVIORS = ("reverse", "comply")


class _Checked:
    """Fields are numbers in SI units: above 0, or where ``_zero`` names them 0 or above."""

    _zero: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        for field in dataclasses.fields(self):  # type: ignore[arg-type]
            value = getattr(self, field.name)
            if isinstance(field.default, (str, bool)) or (value is None and field.default is None):
                continue
            check = not_negative if field.name in self._zero else positive
            number = check(field.name, value, "")
            if number and not SMALLEST <= number <= LARGEST:
                ends = f"from {SMALLEST:g} to {LARGEST:g}"
                raise CoverError(f"{field.name} is {number:g}; it must lie {ends}, all are in SI units")
            object.__setattr__(self, field.name, number)


@dataclasses.dataclass(frozen=True)
class ArmLink(_Checked):
    """The arm, which turns about one joint; gravity plays no part."""

    inertia_kgm2: float
    """J about the joint, in kg m2, without the motor."""
    lever_m: float
    """From the joint to where speeds are measured, in m; a touch lies there too unless it says where."""
    speed_m_s: float
    """With which the arm comes, in m/s."""
    _zero = ("speed_m_s",)


@dataclasses.dataclass(frozen=True)
class Motor(_Checked):
    """A direct-current gear motor in a current loop: u = gain (i_ref - i) + R i_ref + k N omega, within the supply."""

    gear: float
    """Turns of the motor a turn of the joint."""
    torque_constant: float
    """k in Nm/A, and in V s/rad."""
    rotor_kgm2: float
    resistance_ohm: float
    inductance_h: float
    supply_v: float
    current_a: float
    """The most the current is asked for, in A."""
    current_gain: float
    """Of the current loop, in V/A."""

    @property
    def torque_nm_a(self) -> float:
        """At the joint, in Nm/A."""
        return self.gear * self.torque_constant

    @property
    def inertia_kgm2(self) -> float:
        """The rotor's, seen from the joint."""
        return self.gear**2 * self.rotor_kgm2

    @property
    def time_constant_s(self) -> float:
        """Of the current in its loop, away from the supply's limit."""
        return self.inductance_h / (self.resistance_ohm + self.current_gain)


@dataclasses.dataclass(frozen=True)
class Control(_Checked):
    """Speed controller, behavior, and what it trusts."""

    period_s: float
    """Between two samples, in s."""
    proportional: float
    """Current for an error of the joint's speed, in A s/rad."""
    integral: float
    """In A/rad. It does not grow while the current is at its limit."""
    reverse_m_s: float
    """With which it goes back from a contact, at the lever, in m/s."""
    slowing_m_s2: float
    """With which it slows down after a contact was resolved, in m/s2."""
    torque_limit_nm: float
    """Torque between motor and arm at which it goes back whatever the sheet says, in Nm."""
    sensor_nm: float = 3.0
    """Range of the torque sensor; it reads no more than that."""
    clear_s: float = 1e-3
    """How long there must be no contact before it counts as resolved, in s."""
    retreat_m: float = 0.01
    """How far it goes back at most, and how far after the torque limit, which cannot tell when a contact ends."""
    watchdog_s: float = 20e-3
    """The host may be silent for this long, in s; then the arm stops."""
    delay_s: float = 0.0
    """Age of the measured speed and torque, in s, where the loop is closed over a link."""
    behavior: str = "reverse"
    """One of :data:`BEHAVIORS`."""
    virtual_kgm2: float = 0.02
    """``comply``: inertia of the admittance, in kg m2."""
    virtual_damping: float = 0.5
    """``comply``: its damping, in Nm s/rad."""
    virtual_stiffness: float = 4.0
    """``comply``: of the spring that brings it back, in Nm/rad."""
    _zero = ("delay_s", "clear_s", "virtual_stiffness")


@dataclasses.dataclass(frozen=True)
class Foam(_Checked):
    """The cover: F = K_s delta^1.5 (1 + damping d delta/dt), and below it a stiff base."""

    modulus_pa: float
    poisson: float
    radius_m: float
    """R*, in m."""
    thickness_m: float
    damping: float = 0.0
    """In s/m, after Hunt and Crossley; 0: nothing is lost."""
    base_n_m: float = 1e6
    """What comes on top from the indentation on at which the foam is pressed flat, its thickness, in N/m."""
    cut: bool = False
    """It is cut into tiles between the caps; the plant's spring is that of whole foam all the same."""
    _zero = ("damping",)

    @functools.cached_property
    def stiffness(self) -> float:
        """K_s in N/m^1.5."""
        return elastic.stiffness(Ball(self.radius_m, elastic.effective_modulus_pa(self.modulus_pa, self.poisson)))

    def force_n(self, indentation_m: float, rate_m_s: float = 0.0) -> float:
        """Force in N at an indentation that grows by ``rate_m_s``; it never pulls."""
        if indentation_m <= 0:
            return 0.0
        force = self.stiffness * indentation_m * math.sqrt(indentation_m) * (1 + self.damping * rate_m_s)
        return max(0.0, force) + self.base_n_m * max(0.0, indentation_m - self.thickness_m)


@dataclasses.dataclass(frozen=True)
class Contacts(_Checked):
    """The switches below the cover; what is not said here is as in :class:`contactfpga.design.cover.Switch`."""

    force_n: float
    area_m2: float
    travel_m: float = 0.0
    spread: float = 0.0
    hysteresis: float = 0.2
    preload_n: float = 0.0
    bounce_s: float = 0.0
    """How long it bounces after closing and after opening."""
    bounce_period_s: float = 0.4e-3
    """Open and closed again, while it bounces."""
    _zero = ("travel_m", "spread", "hysteresis", "preload_n", "bounce_s")

    @functools.cached_property
    def switch(self) -> Switch:
        """What closes, without its bounce."""
        return Switch(self.force_n, self.area_m2, self.travel_m, self.spread, self.hysteresis, self.preload_n)


@dataclasses.dataclass(frozen=True)
class Touch(_Checked):
    """Something that the arm runs into, or that pushes it."""

    x_mm: float = 80.0
    """Where it presses, on the sheet laid flat: along the columns, column 0 lies at 0."""
    y_mm: float = 80.0
    lever_m: float | None = None
    """From the joint; None: that of the link."""
    gap_m: float = 0.0
    """How much farther away it is than the first that is touched."""
    mass_kg: float = 0.0
    """Of what gives way; 0: it is rigid."""
    stiffness_n_m: float = 0.0
    """Of what holds that mass."""
    damping_ns_m: float = 0.0
    push_m_s: float = 0.0
    """Speed with which it comes toward the arm; 0: it stays where it is."""
    push_m: float = 0.0
    """How far it comes."""
    hold_s: float = 0.0
    """How long it stays there; then it goes back as fast."""
    _zero = ("x_mm", "y_mm", "gap_m", "mass_kg", "stiffness_n_m", "damping_ns_m", "push_m_s", "push_m", "hold_s")

    def pushed(self, seconds: float) -> tuple[float, float]:
        """How far it has come toward the arm, and how fast it does."""
        if seconds <= 0 or not self.push_m_s:
            return 0.0, 0.0
        takes = self.push_m / self.push_m_s
        if seconds < takes:
            return self.push_m_s * seconds, self.push_m_s
        left = 2 * takes + self.hold_s - seconds
        if left >= takes:
            return self.push_m, 0.0
        return (self.push_m_s * left, -self.push_m_s) if left > 0 else (0.0, 0.0)


@dataclasses.dataclass(frozen=True)
class Usb(_Checked):
    """How bytes come from the board's UART to the program: a USB serial chip, and the host."""

    packet_bytes: float = 510
    """The chip sends when it holds this many, or when its timer ran out."""
    timer_s: float = 1e-3
    """Its latency timer: 1 ms is what the driver sets, 16 ms what a system has."""
    frame_s: float = 125e-6
    """Between two moments at which the host takes something."""
    host_s: float = 0.1e-3
    """From there through the host's program to the motor's controller."""
    _zero = ("timer_s", "host_s")


@dataclasses.dataclass(frozen=True)
class Run(_Checked):
    """Times of the simulation."""

    step_s: float = 10e-6
    """Of the integrator, and between two looks of gateware and plant at each other, in s."""
    lead_s: float = 20e-3
    """From power-up, when the controller samples first, to the touch; a whole number of steps."""
    duration_s: float = 0.25
    """From the touch to the end, at most."""
