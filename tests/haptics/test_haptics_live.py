"""Forces end to end: contacts press a sheet and its units, the compiled board sends, the driver and haptics answer."""

import json

import numpy as np
import pytest
from bumpers import flat

import contactfpga
from contactfpga import Skin
from contactfpga.robot.haptics import (
    AloneWatch,
    Cylinder,
    Drift,
    HapticsError,
    LoadCells,
    Plane,
    WithReadings,
    Wrench,
    contacts,
    felt,
)
from contactfpga.robot.haptics.units import write
from contactfpga.tools import cli
from contactfpga.tools.console.forces import Forces
from contactfpga.tracking.tracker import Tracker
from contactfpga_sim.model.board.virtual import VirtualBoard
from contactfpga_sim.model.scenes.contacts import Contact, Track, disc
from contactfpga_sim.model.scenes.felt import UnitReadings
from contactfpga_sim.model.scenes.scene import Scene

SKIN = Skin(rows=4, columns=4, units=3, unit_sums=[[1, 1, 1], [127, -127, 5]])  # which other tests compile, too
CORNER = (-0.015, -0.015)
HERE = "sim://?skin={skin}&units={units}&scene="


def bumper(**more):
    units = flat(0.03, gain_n=0.02, zero=1000.0, range=(0.0, 4095.0), **more).units
    return LoadCells(units, frame="bumper", surface=Plane(), sheet_m=CORNER)


def finger(x_mm, y_mm, force_n, **more):
    return Contact(shape=disc(6.0), x_mm=x_mm, y_mm=y_mm, force_n=force_n, **more)


@pytest.fixture
def files(tmp_path):
    """The start of an address, and the file of the units."""
    skin, units = tmp_path / "skin.toml", tmp_path / "units.toml"
    skin.write_text(SKIN.to_toml())
    units.write_text(write(bumper()))
    return HERE.format(skin=skin, units=units), str(units)


@pytest.mark.slow
def test_forces_of_two_contacts_come_through_gateware_and_driver():
    cells = bumper()
    scene = Scene((finger(0, 0, 12.0), finger(30, 20, 5.0)))
    with contactfpga.open(VirtualBoard(SKIN, scene, units=cells), SKIN) as board:
        frames, follow = WithReadings(board), Tracker()
        found = []
        for _ in range(80):
            zones = frames.next()
            tracks = follow.update(zones)
            if len(zones) == 2 and zones.units is not None:
                found.append(felt(cells, zones, tracks=tracks))
    assert len(found) > 40
    pushes = np.array([[one.normal_n for one in each] for each in found])
    stated = found[0].covariance_n2.diagonal()[[2, 5]] ** 0.5
    assert pushes.mean(axis=0) == pytest.approx([12, 5], abs=0.15)  # the zones lie in the middle of the contacts
    assert np.all(pushes.std(axis=0) < stated * 1.3)
    first, second = found[0]
    assert first.point_m == pytest.approx((-0.015, -0.015, 0))
    assert second.point_m == pytest.approx((0.015, 0.005, 0))
    assert first.link == first.frame == "bumper"
    assert first.track != second.track
    assert first.time_us is not None
    assert first.covariance_m2 == pytest.approx(np.diag([1e-4 / 12, 1e-4 / 12, 0]))


@pytest.mark.slow
@pytest.mark.parametrize(("second_s", "off_n"), [(0.03, 0.1), (0.01, 1.3)])
def test_a_contact_that_was_alone_for_20_ms_is_where_its_center_of_pressure_was(second_s, off_n):
    """The sheet puts it at a switch, 4.2 mm off, of 38 mm: 12 N are split wrongly by 1.3 N."""
    cells = bumper()
    later = Track((second_s - 1e-6, second_s), (0.0, 12.0))
    scene = Scene((finger(3.0, 3.0, 12.0), finger(30, 30, later)))
    with contactfpga.open(VirtualBoard(SKIN, scene, units=cells), SKIN) as board:
        frames, watch, found = WithReadings(board), AloneWatch(cells), []
        while len(found) < 40:
            zones = frames.next()
            watch.take(zones)
            if len(zones) == 2 and zones.units is not None and zones.time_us > 1e6 * second_s + 500:
                found.append(felt(cells, zones, alone=watch))
    pushes = np.mean([[one.normal_n for one in each] for each in found], axis=0)
    assert np.abs(pushes - 12.0).max() == pytest.approx(off_n, abs=0.15)
    assert (found[-1][0].touch.point_sigma_m < 3e-4) == (off_n < 1)
    assert found[-1][1].touch.point_sigma_m == pytest.approx(1e-2 / 12**0.5)


@pytest.mark.slow
def test_readings_of_a_frame_are_those_of_its_moment():
    """A push that rises by 1 N in 5 ms: what is felt is off by noise and steps, not by the time until it is sent."""
    cells = bumper(sigma_n=1e-6)
    scene = Scene((finger(10, 10, Track((0.0, 0.02), (1.0, 41.0))),))
    with contactfpga.open(VirtualBoard(SKIN, scene, units=cells), SKIN) as board:
        frames = WithReadings(board)
        late = []
        while (zones := frames.next()).time_us < 15_000:
            if len(zones) and zones.units is not None:
                (one,) = felt(cells, zones)
                late.append(one.normal_n - scene.contacts[0].force_n(zones.time_us / 1e6))
    assert len(late) > 50
    assert abs(np.mean(late)) < 0.25  # 0.2 ms, in which the virtual board looks at the scene once, are 0.4 N
    assert np.std(late) < 0.3


def test_frames_wait_for_their_readings_but_not_forever():
    class Frame:
        def __init__(self, time_us, units):
            self.time_us, self.units = time_us, units

    class Frames:
        def __init__(self, frames):
            self.left = list(frames)

        def next(self, timeout=1.0):
            if not self.left:
                raise contactfpga.errors.ReplayEnded("over")
            return self.left.pop(0)

    known, lost, last = Frame(0, "read"), Frame(10, None), Frame(30_000, "read")
    assert list(WithReadings(Frames([known, lost, last]))) == [known, lost, last]
    waiting = WithReadings(Frames([lost, Frame(20, None), last]))
    assert waiting.next() is lost  # 20 ms of device time passed


def test_what_drags_and_turns_is_felt_by_units_alone():
    """Around a cylinder of 38 mm under 5 mm of foam: the force enters farther out, at the same angle."""
    hexapod = LoadCells.load(contactfpga.examples() / "units.toml")
    cells = LoadCells(hexapod.units, surface=Cylinder(0.043), sheet_m=(0.0, -0.075))
    one = finger(20.0, 60.0, 12.0, drag_n=(3.0, -2.0), torsion_nm=0.02)
    read = UnitReadings(Scene((one,)), cells, SKIN.replace(surface="cylinder", radius_mm=38.0), noise=False).exact(0.0)
    center = cells.surface.center(cells.wrench(read))
    assert center.sheet_m == pytest.approx((0.020 * 43 / 38, -0.015))
    assert (center.normal_n, center.tangential_n) == pytest.approx((12.0, 13**0.5))
    assert center.torsion_nm == pytest.approx(0.02)


def test_a_drifted_unit_is_named_with_its_drift():
    forces = Forces(bumper(), 0.5)
    forces.contacts = contacts(Wrench((0.0, 0.0, 0.0), (0.0, 0.0, 0.0)), [])
    forces.drift = Drift(np.array([0.0, -0.4123, 0.01]), (1,), 12.0)
    assert forces.sentences() == ["unit 1 drifted by -0.41 N"]
    assert forces.to_dict()["drifted"] == [1]


@pytest.mark.slow
def test_a_sheet_without_surface_is_refused():
    with contactfpga.open(VirtualBoard(SKIN, Scene(())), SKIN) as board:
        with pytest.raises(HapticsError, match="surface is missing"):
            felt(flat(), board.next())


def test_zones_show_forces(files, capsys):
    address, units = files
    assert cli.main(["zones", address + "fingertip", "--once", "--units", units]) == 0
    shown = capsys.readouterr().out
    assert "from" in shown
    assert cli.main(["zones", address + "fingertip", "--once", "--json", "--units", units, "--tracks"]) == 0
    answer = json.loads(capsys.readouterr().out)
    (one,) = answer["contacts"]
    assert one["normal_n"] == pytest.approx(10, abs=0.4)
    assert one["track"] == answer["tracks"][0]["id"]
    assert answer["drifted"] == []


def test_zeros_are_read_set_and_written(files, tmp_path, capsys):
    address, units = files
    better = tmp_path / "better.toml"
    assert cli.main(["haptics", "zero", address + "nothing", "--units", units, "--output", str(better)]) == 0
    assert capsys.readouterr().out.count("the board took") == 3
    made = LoadCells.load(better)
    assert made.zeros == pytest.approx([1000] * 3, abs=2)
    assert (made.surface, made.sheet_m, made.frame) == (Plane(), CORNER, "bumper")
    assert cli.main(["haptics", "zero", address + "nothing", "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert answer["file"] is None
    assert [one["set_steps"] for one in answer["units"]] == pytest.approx([1000] * 3, abs=2)
    assert cli.main(["haptics", "zero", address + "fingertip"]) == 2
    assert "pressed zones: 1" in capsys.readouterr().err


def test_thresholds_are_set_in_steps_and_newtons(files, capsys):
    address, units = files
    assert cli.main(["haptics", "threshold", address + "nothing", "--unit", "0=400", "--sum", "1=0"]) == 0
    said = capsys.readouterr().out
    assert "unit 0: raises contact from a deviation of 400 steps on" in said
    assert "sum 1: never raises contact" in said
    newtons = ["--unit", "2=8", "--units", units, "--sum", "1=0"]
    assert cli.main(["haptics", "threshold", address + "nothing", *newtons, "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found == {"thresholds": [{"unit": 2, "steps": 400}, {"sum": 1, "steps": 0}]}


@pytest.mark.parametrize(
    ("flags", "message"),
    [
        ([], "no threshold is given"),
        (["--unit", "0=1", "--unit", "3=1"], "--unit names unit 3; the board has 3, counted from 0"),
        (["--unit", "0=0.4"], "less than half a step"),
    ],
)
def test_thresholds_that_cannot_be(files, capsys, flags, message):
    address, _ = files
    assert cli.main(["haptics", "threshold", address + "nothing", *flags]) != 0
    out, said = capsys.readouterr()
    assert message in said
    assert "Traceback" not in said
    assert out == "", "none is set"


def test_units_that_do_not_fit_the_board_are_refused(files, tmp_path, capsys):
    address, _ = files
    other = tmp_path / "two.toml"
    other.write_text(write(LoadCells(bumper().units[:2], surface=Plane())))
    assert cli.main(["zones", address + "nothing", "--once", "--units", str(other)]) != 0
    assert "there are 2 units; the board has 3" in capsys.readouterr().err
    assert cli.main(["zones", f"sim://?units={other}", "--once"]) != 0
    assert "there are 2 units; the Skin has units = 0" in capsys.readouterr().err
    assert cli.main(["zones", address + "u_shape", "--once"]) != 0
