from __future__ import annotations

import dataclasses
import functools

from contactfpga.design.cover import Ball, Switch, elastic
from contactfpga.design.cover.answer import LARGEST, SMALLEST, CoverError, not_negative, positive
from contactfpga.design.cover.hertz import HalfSpace
from contactfpga_sim.apps.latency.usb import HOST_S


class _Checked:
    """Fields are numbers in SI units: above 0, or, if ``_zero`` names them, 0 or above."""

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
    """The arm on one joint, without gravity."""

    inertia_kgm2: float
    """J about the joint, without the motor."""
    lever_m: float
    """Distance from the joint to where speeds are measured, and to touches without their own lever."""
    speed_m_s: float


@dataclasses.dataclass(frozen=True)
class Motor(_Checked):
    """A direct-current gear motor in a current loop: u = gain (i_ref - i) + R i_ref + k N omega, within the supply."""

    gear: float
    """Motor turns per turn of the joint."""
    torque_constant: float
    """k in Nm/A, and in V s/rad."""
    rotor_kgm2: float
    resistance_ohm: float
    inductance_h: float
    supply_v: float
    current_a: float
    current_gain: float
    """Gain in V/A."""

    @property
    def torque_nm_a(self) -> float:
        return self.gear * self.torque_constant

    @property
    def inertia_kgm2(self) -> float:
        """Rotor inertia seen from the joint."""
        return self.gear**2 * self.rotor_kgm2

    @property
    def time_constant_s(self) -> float:
        """Time constant of the closed current loop, within the supply."""
        return self.inductance_h / (self.resistance_ohm + self.current_gain)


@dataclasses.dataclass(frozen=True)
class Control(_Checked):
    period_s: float
    proportional: float
    """Current for an error of the joint's speed, in A s/rad."""
    integral: float
    """Gain in A/rad; held while the current is at its limit."""
    reverse_m_s: float
    """Speed at the lever."""
    slowing_m_s2: float
    torque_limit_nm: float
    """Torque that causes a retreat whatever the sheet reports."""
    sensor_nm: float = 3.0
    """Range at which the torque sensor saturates."""
    clear_s: float = 1e-3
    """Time without contact that resolves it."""
    retreat_m: float = 0.01
    """Longest retreat; always used after the torque limit, which cannot detect a contact's end."""
    watchdog_s: float = 20e-3
    """Host silence that stops the arm."""
    delay_s: float = 0.0
    """Age of measurements if the loop runs over a link."""
    _zero = ("delay_s", "clear_s")


@dataclasses.dataclass(frozen=True)
class Foam(_Checked):
    """The cover, with losses F (1 + damping d delta/dt)."""

    modulus_pa: float
    radius_m: float
    """R* of the arm on what it runs into."""
    thickness_m: float
    poisson: float = 0.5
    """For the paper's half-space."""
    damping: float = 0.0
    """Damping in s/m, after Hunt and Crossley; 0: lossless."""
    base_n_m: float = 1e6
    """Base under the half-space, added once it is pressed flat."""
    cut: bool = False
    """Whether foam is cut into tiles."""
    _zero = ("damping",)

    @functools.cached_property
    def half_space(self) -> HalfSpace:
        """The paper's spring."""
        ball = Ball(self.radius_m, elastic.effective_modulus_pa(self.modulus_pa, self.poisson))
        return HalfSpace(ball, self.thickness_m, self.base_n_m)


@dataclasses.dataclass(frozen=True)
class Contacts(_Checked):
    """Switches below the cover."""

    force_n: float
    area_m2: float
    travel_m: float = 0.0
    spread: float = 0.0
    hysteresis: float = 0.2
    preload_n: float = 0.0
    bounce_s: float = 0.0
    bounce_period_s: float = 0.4e-3
    _zero = ("travel_m", "spread", "hysteresis", "preload_n", "bounce_s")

    @functools.cached_property
    def switch(self) -> Switch:
        return Switch(self.force_n, self.area_m2, self.travel_m, self.spread, self.hysteresis, self.preload_n)


@dataclasses.dataclass(frozen=True)
class Touch(_Checked):
    """A thing that the arm runs into."""

    x_mm: float = 80.0
    """Place along the columns of the flat sheet; column 0 is at 0."""
    y_mm: float = 80.0
    lever_m: float | None = None
    """Distance from the joint; None: the link's."""
    gap_m: float = 0.0
    """Distance beyond the first touched thing."""
    mass_kg: float = 0.0
    """Mass of the yielding part; 0: rigid."""
    stiffness_n_m: float = 0.0
    damping_ns_m: float = 0.0
    _zero = ("x_mm", "y_mm", "gap_m", "mass_kg", "stiffness_n_m", "damping_ns_m")


@dataclasses.dataclass(frozen=True)
class Usb(_Checked):
    """Path of bytes from UART through a USB serial chip to the program."""

    packet_bytes: float = 510
    """Bytes at which the chip sends before its timer ends."""
    timer_s: float = 1e-3
    """Latency timer: 1 ms by the driver; operating systems default to 16 ms."""
    frame_s: float = 125e-6
    host_s: float = HOST_S
    """Time through the host's program to the controller."""
    _zero = ("timer_s", "host_s")


@dataclasses.dataclass(frozen=True)
class Run(_Checked):
    step_s: float = 10e-6
    """Step of integrator and gateware exchange."""
    lead_s: float = 20e-3
    """Time from power-up, the controller's first sample, to the touch; a whole number of steps."""
    duration_s: float = 0.25
