"""The table of foams, the file of a design, and the line of Fig. 9."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from contactfpga import Skin
from contactfpga.design.cover import CoverError, line
from contactfpga.design.cover.design import design
from contactfpga.design.cover.foams import FOAMS, Foam, find
from contactfpga.design.cover.task import Task
from contactfpga.skin.latency import latency_s

ROOT = Path(__file__).resolve().parents[2]
FIRST, SECOND = (ROOT / "examples" / f"paper-{name}-design.toml" for name in ("first", "second"))
TEXT = FIRST.read_text()


# ---- the table of foams


def test_every_foam_has_its_source():
    assert len({foam.name for foam in FOAMS}) == len(FOAMS)
    for foam in FOAMS:
        assert len(foam.source) > 20
        assert 1e4 < foam.modulus_pa < 1e7
        if foam.density_kg_m3 is not None:
            assert "kg/m3" in foam.source
    assert find("paper").modulus_pa == 3.45e5
    with pytest.raises(CoverError, match="foam is 'felt'; known are 'paper', 'paper, Y printed', 'PORON"):
        find("felt")
    with pytest.raises(CoverError, match=r"strain is 1\.2; it must lie above 0 and not above 1"):
        Foam("x", 1e5, "made up", strain=1.2)
    with pytest.raises(CoverError, match="density_kg_m3 is -3; it must be a finite number above 0 kg/m3"):
        Foam("x", 1e5, "made up", density_kg_m3=-3)


# ---- the file


def test_own_foams_and_another_skin(tmp_path):
    (tmp_path / "skin.toml").write_text("rows = 32\ncolumns = 32\n")
    file = tmp_path / "task.toml"
    own = '[[foam]]\nname = "own"\nmodulus_pa = 2e5\nsource = "measured"\ndensity_kg_m3 = 90\nyield_pa = 6e4\n'
    text = TEXT.replace("[reaction]", '[reaction]\nskin = "skin.toml"').replace('foams = ["paper",', 'foams = ["own",')
    file.write_text(text + own)
    task = Task.load(file)
    assert task.foams[0] == Foam("own", 2e5, "measured", 90, 6e4)
    assert task.skin.rows == 32
    assert design(task).sheet_s == pytest.approx(latency_s(Skin(rows=32, columns=32)))


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("[switch]", "[swich]", "unknown part 'swich'; did you mean 'switch'?"),
        ("lever_m = 0.200", "lever = 0.2", "unknown key 'lever' in [arm]; did you mean 'lever_m'?"),
        ("lever_m = 0.200", "", "lever_m is missing in [arm]"),
        (
            "lever_m = 0.200",
            'lever_m = "long"',
            "lever_m in [arm] is 'long'; it must be a number, 0 or from 1e-12 to 1e+12",
        ),
        ("lever_m = 0.200", "lever_m = 0.2\ntube = 1", "tube in [arm] is 1; it must be true or false"),
        ('rule = "printed"', 'rule = "best"', "rule is 'best'; it must be one of printed, printed_exact"),
        ('rule = "printed"', "rule = 3", "rule in [cover] is 3; it must be a text"),
        ("plates_m = [0.005, 0.010]", "plates_m = 0.005", "plates_m in [cover] is 0.005; it must be a list"),
        ("plates_m = [0.005, 0.010]", "strain = 2", "strain is 2; it must not be above 1"),
        ("force_n = 15.0", "force_n = 15.0\npitch_min_m = 0.02", "pitch_min_m is 0.02; it must not be above pitch_m"),
        ("[switch]", "switch = 3\n[x]", "not a TOML file"),
        ("[arm]", "[[foam]]\nstiffness = 1\n[arm]", "unknown key 'stiffness' in [[foam]]; known are name, modulus_pa"),
    ],
)
def test_a_file_that_cannot_be_is_refused(tmp_path, old, new, message):
    assert old in TEXT
    file = tmp_path / "task.toml"
    file.write_text(TEXT.replace(old, new))
    if message == "not a TOML file":
        file.write_text("[arm\n")
    with pytest.raises(CoverError) as caught:
        Task.load(file)
    assert message in str(caught.value)


def test_nothing_to_choose_from():
    with pytest.raises(CoverError, match="foams is empty and free is false; there is nothing to choose from"):
        replace(Task.load(FIRST), foams=(), free=False)


# ---- the line of Fig. 9


@pytest.mark.parametrize("header", ["force_n,deformation_m\n", "\ufeff"])
def test_line_of_measured_points(tmp_path, header):
    random = np.random.default_rng(3)
    force = np.linspace(0, 30, 40)
    depth = 1e-4 + force / 9000 + random.normal(0, 2e-5, 40)
    file = tmp_path / "foam.csv"
    rows = "".join(f"{f},{d}\n" for f, d in zip(force, depth))
    file.write_text(header + rows + "\n# end\n")
    read = line.read(file)
    assert (read[0].tolist(), read[1].tolist()) == (force.tolist(), depth.tolist())
    fitted = line.fit(*read)
    slope, offset = np.polyfit(force, depth, 1)
    assert fitted.stiffness_n_m == pytest.approx(1 / slope)
    assert fitted.offset_m == pytest.approx(offset)
    assert fitted.correlation == pytest.approx(np.corrcoef(force, depth)[0, 1])


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("1,2\n3,4\n", "2 points; a line with a correlation needs 3"),
        ("1,2\n3,x\n", "line 2: '3,x' is not two numbers, force in N and deformation in m"),
        ("1,2\n3,4,5\n", "line 2: '3,4,5' is not two numbers"),
        ("1,2\n3,nan\n", "line 2: '3,nan' is not two numbers"),
    ],
)
def test_points_that_cannot_be_are_refused(tmp_path, text, message):
    file = tmp_path / "foam.csv"
    file.write_text(text)
    with pytest.raises(CoverError) as caught:
        line.read(file)
    assert message in str(caught.value)


def test_points_without_a_line():
    with pytest.raises(CoverError, match="force and deformation do not vary together; there is no line"):
        line.fit(np.array([1.0, 1, 1]), np.array([1.0, 2, 3]))
