"""Numbers that no bumper has: each call of contactfpga.haptics answers with finite numbers or with one sentence."""

import itertools
import math
import warnings

import numpy as np
import pytest

from contactfpga import ContactFPGAError
from contactfpga.cover import Switch
from contactfpga.design.cover.sense import Model, PaddedSheet
from contactfpga.haptics import (
    Bumper,
    Closing,
    Cylinder,
    DriftWatch,
    LoadCells,
    Locator,
    Motion,
    Plane,
    Reach,
    Touch,
    Unit,
    Wrench,
    calibrate,
    contacts,
)
from contactfpga.robot.haptics.rate import Requirements
from contactfpga.skin import Skin

ODD = (1e300, 5e-324, 1e25, 1e-25, math.nan, math.inf, -1.0, 0.0, -5e-324, -1e-25, -1e300, 10**400)
PLACES = ((0.05, 0.0), (-0.03, 0.04), (-0.02, -0.05))


def three(x=0.0, axis=1.0, gain=1.0, zero=0.0, sigma=0.05, preload=9.0):
    return LoadCells(
        [Unit((x or a, b, 0.0), (0.0, 0.0, axis), gain, zero, sigma, preload_n=preload) for a, b in PLACES],
        surface=Plane(0.01),
    )


def numbers(found):
    """Of contacts and their intervals; None, where there is no largest push, aside."""
    each = [number for one in found for number in (one.normal_n, *one.force_n, *one.interval_n) if number is not None]
    return [*each, *([] if found.chi2 is None else [found.chi2])]


def felt(count, noise, force, moment, x, friction, sigma):
    made = three().noise if noise else None
    if noise == "whole":
        made = type(made)(np.diag([0.01, 0.01, 0.01, 1e-5, 1e-5, 1e-5]))
    touches = [Touch((x or a, b, 0.01), (0.0, 0.0, 1.0), friction, sigma) for a, b in PLACES[:count]]
    return numbers(contacts(Wrench((0.5, 0.0, force), (moment, 0.01, 0.0), made), touches))


def read(reading, *unit):
    cells = three(*unit)
    wrench = cells.wrench([reading, 2.0, 3.0])
    return [*wrench.array, *wrench.noise.covariance.ravel()]


def centered(make, length, force, moment):
    found = make(length).center(Wrench((force, 0.0, force), (0.01, moment, 0.0), three().noise))
    return [] if found is None else [*found.point_m, found.normal_n, found.torsion_nm]


def carried(mass, gravity, turning):
    cells = LoadCells(three().units, bumper=Bumper(mass, (0.0, 0.0, 0.02)))
    return cells.wrench([1.0, 2.0, 3.0], Motion((0.0, 0.0, gravity), turning_rad_s=(turning, 0.0, 0.0))).array


def calibrated(reading, load):
    loads = np.random.default_rng(1).normal(size=(8, 6)).tolist()
    readings = np.random.default_rng(2).normal(size=(8, 3)).tolist()
    readings[3][1], loads[2][4] = reading, load
    return calibrate(three(), readings, loads).cells.matrix


def drifted(limit, over, time, reading):
    watch = DriftWatch(three(), limit, over)
    for step in range(3):
        found = watch.update(step * time, [reading, 0.0, 0.0], 0)
    return found.deviations_n


REACH = Reach(PaddedSheet(Switch(), 0.005), Model("halfspace", "point"))


def located(spread, sigma, force, closing):
    found = Locator(Skin().sheet, REACH, spread, sigma).locate([(7, 7), (7, 8)], force, [Closing(7, 7, closing)])
    return [found.x_m, found.y_m, found.radius_m]


def required(low, high, force, friction):
    return [*Requirements(Cylinder(0.038), (low, high), force, friction).middle_m]


CALLS = {
    **{
        f"contacts, {count}, noise {noise}": (lambda *given, count=count, noise=noise: felt(count, noise, *given),
                                               -9.0, 0.01, 0.0, 0.5, 1e-3)
        for count, noise in itertools.product((1, 2, 3), ("", "three units", "whole"))
    },
    "wrench": (read, 1.0, 0.0, 1.0, 1.0, 0.0, 0.05, 9.0),
    "plane": (lambda *given: centered(Plane, *given), 0.01, -5.0, 0.02),
    "cylinder": (lambda *given: centered(Cylinder, *given), 0.04, -5.0, 0.02),
    "motion": (carried, 0.5, -9.8, 1.0),
    "calibrate": (calibrated, 0.3, 1.0),
    "drift": (drifted, 0.2, 1.0, 0.5, 0.1),
    "locate": (located, 0.1, 0.5, 12.0, 8.0),
    "requirements": (required, -0.075, 0.075, 30.0, 0.5),
    "reach": (lambda force, far: [REACH.reach_m(force), *REACH.closing_n(np.array([far]))], 12.0, 3e-3),
}  # fmt: skip


@pytest.mark.parametrize("call", CALLS.values(), ids=CALLS)
def test_an_odd_number_gives_an_answer_or_one_sentence(call):
    function, *usual = call
    said = []
    for place, value in itertools.product(range(len(usual)), ODD):
        given = [*usual]
        given[place] = value
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("error")
                found = function(*given)
        except ContactFPGAError as error:
            said.append(str(error))
        except Exception as error:
            raise AssertionError(f"{given}: {error!r}") from error
        else:
            assert np.isfinite(np.asarray(found, float)).all(), given
    assert said
    assert all(0 < len(text) < 300 and "\n" not in text for text in said)
    assert np.isfinite(function(*usual)).all()
