"""The commands `contactfpga cover design` and `contactfpga cover figures`."""

import json
import math
import sys
from pathlib import Path

import pytest
from sample import sample

import contactfpga
from contactfpga.design.cover import elastic, sense

ROOT = Path(__file__).resolve().parents[2]
FIRST, SECOND = (ROOT / "examples" / f"paper-{name}-design.toml" for name in ("first", "second"))


# ---- commands


def test_impact_and_design_need_numpy_alone(python):
    code = (
        "import sys; from contactfpga.tools import cli; "
        f"cli.main(['cover', 'design', {str(FIRST)!r}]); cli.main(['cover', 'sense', '--pitch', '0.01']); "
        "print(*sorted(set(sys.modules) & {'scipy', 'matplotlib', 'rich', 'amaranth', 'contactfpga_sim', 'mpmath'}))"
    )
    assert python(code).stdout.splitlines()[-1] == ""


def test_figures_without_matplotlib_name_what_to_install(run, monkeypatch):
    for name in [name for name in sys.modules if name.partition(".")[0] == "matplotlib"]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.delitem(sys.modules, "contactfpga.design.cover.drawing", raising=False)
    monkeypatch.delattr(contactfpga.design.cover, "drawing", raising=False)
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    status, _, errors = run("figures")
    assert status == 1
    assert "pip install 'contactfpga[sim]'" in errors


ARM = [*("--mass", 0.6, "--radius", 0.038, "--com", 0.15, "--lever", 0.2, "--speed", 0.4)]
ARM += ["--poisson", 0.5, "--effective-radius", 0.019]
SWITCH = ["--thickness", 5e-3, "--switch-force", 1, "--switch-area", 12.6e-6]


def test_impact_command(run):
    status, out, errors = run("impact", *ARM, "--modulus", 3.65e5, "--json")
    assert (status, errors) == (0, "")
    found = json.loads(out)
    assert round(1e3 * found["compression_m"], 8) == 3.78018093
    assert round(1e3 * found["time_s"], 7) == 13.9076409
    assert (round(found["force_n"], 4), round(found["stiffness"], 1)) == (20.7882, 89443.2)
    assert found["method"] == "closed"
    assert found["patch_m"] == pytest.approx(math.sqrt(found["compression_m"] * 0.019))
    status, out, _ = run("impact", *ARM, "--modulus", 3.65e5)
    assert status == 0
    for text in ("3.78 mm", "13.908 ms", "20.79 N", "365 kPa", "486.67 kPa", "closed"):
        assert text in out


def test_impact_command_with_length_torque_and_gravity(run):
    given = ["--length", 0.2, "--torque", 0.5, "--gravity", "--angle", 0.3]
    modulus = elastic.young_pa(0.75 * 1e5 / math.sqrt(0.019), 0.5)
    for method in ("auto", "quadrature", "ode"):
        found = json.loads(run("impact", *ARM, *given, "--modulus", modulus, "--solver", method, "--json")[1])
        assert round(1e3 * found["compression_m"], 6) == 3.809762
        assert found["stiffness"] == pytest.approx(1e5)


def test_impact_command_finds_the_modulus(run):
    found = json.loads(run("impact", *ARM, "--time", 0.008, "--json")[1])
    assert round(found["stiffness"]) == 356415
    back = json.loads(run("impact", *ARM, "--modulus", found["modulus_pa"], "--json")[1])
    assert back["time_s"] == pytest.approx(0.008, rel=1e-12)


def test_impact_command_without_solution(run):
    status, out, errors = run("impact", *ARM, "--time", 0.05, "--torque", -1, "--json")
    assert (status, errors) == (3, "")
    reason = "a compression of 50 ms: torque and gravity stop the arm within 31.43 ms whatever the foam"
    assert json.loads(out) == {"no_solution": reason}
    assert run("impact", *ARM, "--time", 0.05, "--torque", -1)[:2] == (3, f"no solution: {reason}\n")
    for flags, text in (
        (["--modulus", 3.65e5, "--thickness", 3e-3], "the foam bottoms out: pressed in by 3.78 mm, it is 3 mm thick"),
        (["--modulus", 3.65e5, "--yield-strength", 4e4], "outside the elastic range: pressed in by 3.78 mm"),
        (["--time", 0.012, "--yield-strength", 4e4], "outside the elastic range: pressed in by 3.262 mm"),
    ):
        status, out, _ = run("impact", *ARM, *flags)
        assert status == 3
        assert text in out


def test_impact_command_says_where_hertz_stops(run):
    out = run("impact", *ARM, "--modulus", 3.65e5, "--thickness", 5e-3)[1]
    assert "note: Hertz stops holding: the patch has a radius of 8.475 mm, the foam is 5 mm thick" in out


def test_sense_command(run):
    status, out, _ = run("sense", "--offset", 5e-3 * math.sqrt(2), *SWITCH, "--model", "halfspace", "--json")
    found = json.loads(out)
    assert (status, round(found["force_n"], 4)) == (0, 64.7785)
    assert round(found["reference_force_n"]) == 341
    assert (found["model"], found["dropped"]) == ("halfspace", ["the rigid base"])
    found = json.loads(run("sense", "--offset", 5e-3 * math.sqrt(2), *SWITCH, "--json")[1])
    assert (round(found["force_n"]), found["model"], found["error"]) == (341, "bonded", 0)
    found = json.loads(run("sense", "--offset", 0, "--force", 12, *SWITCH, "--model", "halfspace", "--json")[1])
    assert (round(1e3 * found["reach_m"], 4), round(1e3 * found["pitch_m"], 4)) == (3.6344, 5.1398)
    out = run("sense", "--pitch", 0.01, *SWITCH)[1]
    assert "340.79 N" in out
    assert "bonded, point" in out


def test_sense_command_with_a_ball(run):
    ball = ["--modulus", 3.45e5, "--effective-radius", 0.038]
    found = json.loads(
        run("sense", "--offset", 0, *SWITCH, *ball, "--model", "halfspace", "--contact", "patch", "--json")[1]
    )
    assert round(found["force_n"], 2) == 28.36
    assert any("Hertz stops holding" in note for note in found["notes"])
    status, out, _ = run("sense", "--force", 12, *SWITCH, *ball)
    assert status == 3
    assert "no solution: 12 N do not even close the switch right below; that takes 26.24 N" in out
    status, out, _ = run("sense", "--offset", 8.4e-3, *SWITCH, "--json")
    assert (status, json.loads(out)["force_n"]) == (3, None)
    assert "from 1.671 on" in json.loads(out)["no_solution"]


def test_sense_command_finds_the_best_thickness(run):
    found = json.loads(run("sense", "--offset", 5e-3 * math.sqrt(2), "--model", "halfspace", "--json")[1])
    assert (round(1e3 * found["thickness_m"], 4), round(found["force_n"], 4)) == (8.6603, 44.7066)
    out = run("sense", "--pitch", 0.01)[1]
    assert f"{1e3 * sense.best_thickness_m(5e-3 * math.sqrt(2), 'bonded'):.5g} mm" in out


@pytest.mark.parametrize(
    ("flags", "message"),
    [
        (["sense", *SWITCH], "nothing is asked; give --offset, --force or --pitch"),
        (["sense", "--force", "3"], "thickness is missing; the best one is found for --offset or --pitch alone"),
        (
            ["sense", "--offset", "0.01", "--model", "bonded", "--contact", "patch"],
            "thickness is missing; the best one is found for a point force only",
        ),
        (["sense", "--offset", "0", "--contact", "patch", *SWITCH], "--contact is 'patch'; name the model, too"),
        (["sense", "--offset", "0", "--modulus", "1e5", *SWITCH], "--effective-radius is missing; a patch needs"),
        (["impact", *ARM, "--time", "0.01", "--solver", "ode"], "the modulus for a time is found by 'auto' only"),
        (["design", "nowhere.toml"], "nowhere.toml"),
    ],
)
def test_wrong_flags_are_told(run, flags, message):
    status, _, errors = run(*flags)
    assert status == 1
    assert errors.startswith("contactfpga: ")
    assert message in errors


def test_design_command(run):
    status, out, _ = run("design", FIRST)
    assert status == 0
    for text in ("fits", "5.792 mm", "force, broken", "the sheet itself: 0.2517 ms"):
        assert text in out
    found = json.loads(run("design", FIRST, "--json")[1])
    assert found["fits"] is True
    assert round(1e3 * found["best"]["pitch_m"], 3) == 5.792
    assert {one["binding"] for one in found["candidates"]} == {"time", "force", "yield"}
    status, out, _ = run("design", SECOND)
    assert status == 3
    assert "thickness_m at least 0.01568 m" in out
    found = json.loads(run("design", SECOND, "--json")[1])
    assert (found["fits"], found["best"]) == (False, None)


@pytest.mark.slow
@pytest.mark.parametrize("suffix", sample(["png", "svg"], quick=["svg"]))
def test_figures_command(run, tmp_path, suffix):
    data = tmp_path / "foam.csv"
    data.write_text("force,deformation\n0,0\n10,1.1e-3\n20,1.9e-3\n30,3e-3\n")
    status, out, _ = run("figures", "--output", tmp_path, "--format", suffix, "--data", data, "--case", FIRST, "--json")
    assert status == 0
    found = json.loads(out)
    names = sorted(Path(file).name for file in found["files"])
    assert names == [f"cover-{name}.{suffix}" for name in ("force", "line", "map")]
    before = [Path(file).read_bytes() for file in found["files"]]
    assert min(map(len, before)) > 3000
    assert found["stiffness_n_m"] == pytest.approx(1 / 0.098e-3)
    assert 0.99 < found["correlation"] < 1
    out = run("figures", "--output", tmp_path, "--format", suffix, "--data", data, "--case", FIRST)[1]
    assert "line: 10.2 N/mm, correlation 0.99" in out
    assert [Path(file).read_bytes() for file in found["files"]] == before
