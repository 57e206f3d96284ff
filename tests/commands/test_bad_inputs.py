"""What no command can use: each ends with a message and a status that is not 0, in time, and never with a traceback."""

import math
import os
import tomllib
import zipfile
from pathlib import Path

import numpy as np
import pytest
from every_command import called, leaves, options
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st
from sample import sample
from wire import Wire

from contactfpga.skin import Skin
from contactfpga.tools import cli
from contactfpga_sim.apps import pool
from contactfpga_sim.lab.arm import report
from contactfpga_sim.model.board import native

ROOT = Path(__file__).resolve().parents[2]
LIMIT_S = 60

pytestmark = pytest.mark.timeout(LIMIT_S)

ARM = "--mass=0.6 --radius=0.038 --com=0.15 --lever=0.2 --speed=0.4 --effective-radius=0.019"
SENSE = ["cover", "sense"]
CELLS = ("FLOATS", "NAN", "COMPLEX", "HUGE", "EMPTY", "WIDE", "SHORT", "RATE", "OTHER", "FOLDER", "FIFO", "NONE")
"""Names of files that hold no recording; those without an ending get .npy."""
TOML = ("TEXT", "DEEP", "DIGITS", "HEX", "DOTTED", "BINARY", "FOLDER", "FIFO", "/dev/zero", "NONE")
NUMBERS = ("nan", "inf", "-inf", "", "x", "1e400", "9" * 5000, f"-{'9' * 400}", "0x10", "1,5")
"""What no numeric option takes."""


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    """Path by name; every path exists but NONE's."""
    folder = tmp_path_factory.mktemp("bad")
    made = {}

    def path(name, suffix=""):
        made[name] = folder / f"{name.lower()}{suffix}"
        return made[name]

    np.save(path("FLOATS", ".npy"), np.ones((4, 4, 4)))
    np.save(path("NAN", ".npy"), np.full((4, 4, 4), np.nan))
    np.save(path("COMPLEX", ".npy"), np.ones((4, 4, 4), complex))
    np.save(path("EMPTY", ".npy"), np.ones((0, 4, 4), bool))
    np.save(path("WIDE", ".npy"), np.ones((4, 4, 65), bool))
    np.save(path("SHORT", ".npy"), np.ones(4, bool))
    np.savez(path("RATE", ".npz"), pressed=np.ones((4, 4, 4), bool), rate_hz="fast")
    with zipfile.ZipFile(path("OTHER", ".npz"), "w") as archive:
        archive.writestr("\x1b[31mred.npy", b"")
    huge = "{'descr': '|b1', 'fortran_order': False, 'shape': (1000000000, 1000, 1000)}".ljust(117) + "\n"
    path("HUGE", ".npy").write_bytes(b"\x93NUMPY\x01\x00" + len(huge).to_bytes(2, "little") + huge.encode())
    path("TEXT", ".npy").write_text("hello = = 1")
    path("DEEP").write_text("rows = " + "[" * 100_000)
    path("DIGITS").write_text(f"settle_us = {'9' * 400}")
    path("HEX").write_text(f"rows = 0x{'f' * 5000}")
    path("DOTTED").write_text(f"rows{'.a' * 5000} = 1")
    path("BINARY").write_bytes(bytes(range(256)))
    path("RECORDED").write_bytes(Wire(Skin()).hello() + Wire(Skin()).zones([]))
    path("NO_HELLO").write_bytes(b"\x00" * 1000)
    path("MCAP").write_bytes(b"\x89MCAP0\r\n" + bytes(range(1, 256)) * 9)
    path("FOLDER", ".npy").mkdir()
    os.mkfifo(path("FIFO", ".npy"))
    path("NONE", ".npy")
    # Commands that read TOML look at the ending, too.
    for name in [name for name in TOML if name in made and name != "NONE"]:
        os.symlink(made[name], folder / f"{name.lower()}.toml")
    return made


@pytest.fixture
def run(run, files, tmp_path, monkeypatch):
    """Runs a command in an empty folder; files by name. Returns status and errors; a traceback is the test's."""
    monkeypatch.chdir(tmp_path)

    def named(argument):
        for name in sorted(files, key=len, reverse=True):
            argument = argument.replace(f"{name}.toml", str(files[name].parent / f"{name.lower()}.toml"))
            argument = argument.replace(name, str(files[name]))
        return argument

    def run_named(*arguments):
        status, out, errors = run(*map(named, arguments))
        return status, out + errors if arguments[:1] == ("doctor",) else errors  # whose findings are its output

    return run_named


def refused(status, errors):
    assert status not in (0, None)
    assert errors.strip()
    assert "Traceback" not in errors
    assert "[Errno" not in errors
    assert "\x1b" not in errors
    for leaked in ("_number", "max_workers", "invalid int value", "invalid float value"):
        assert leaked not in errors
    last = errors.rstrip().splitlines()[-1]
    assert len(last) < 1000
    return last


PORTS = [
    *("replay:///dev/zero", "replay://FIFO", "replay://FOLDER", "replay://~nosuch/x", "replay://", "replay://a\0b"),
    *("replay://NONE", "replay://NO_HELLO", "replay://BINARY", "/dev/null", "NONE", "FOLDER", "TEXT"),
    *("replay://RECORDED?start=1", "replay://RECORDED?link=a", "replay://RECORDED?pace=1&elbow=2", "replay://MCAP"),
    *("replay://RECORDED?start=-1", "replay://RECORDED?pace=1&pace=2", "replay://MCAP?start=nan"),
    *("sim://x", "sim:///", "sim://?scene", "sim://?scene=", "sim://?elbow=1", "sim://?scene=elbow"),
    *("sim://?scene=a%2", "sim://?scene=%ff", "sim://?scene=palm&scene=sole", "sim://?scene=palm&threshold=1"),
    *("sim://?scene=NAN&threshold=1", "sim://?scene=FLOATS", "sim://?scene=FLOATS&threshold=nan"),
    *(f"sim://?scene={name}" for name in CELLS),
    *(f"sim://?skin={name}" for name in TOML),
]
CASES = [
    *(
        [command, "--timeout", "1", *json, port]
        for port in PORTS
        for command, json in (("zones", ["--json"]), ("wire", []))
    ),
    ["zones", "sim://", "--record", "FOLDER"],
    ["publish", "sim://", "--key", ""],
    ["zones", "sim://", "--record", "/no/folder/x"],
    *(["record", "--recover", name] for name in ("NONE", "FOLDER", "FIFO", "BINARY", "/dev/zero", "MCAP", "RECORDED")),
    ["record", "--recover", "RECORDED", "--seconds", "1"],
    ["record", "--recover", "RECORDED", "--bytes-only"],
    *(["export", name, "x.csv"] for name in ("NONE", "FOLDER", "FIFO", "BINARY", "/dev/zero", "MCAP", "NO_HELLO")),
    *(["record", name, "sim://"] for name in ("x.bin", "/no/folder/x.mcap", "x")),
    *(["record", "x.mcap", f"{name}.toml"] for name in TOML if name not in ("/dev/zero", "NONE")),
    ["record", "x.mcap", "replay://NONE"],
    ["record", "x.mcap", "sim://", "--friction", "1"],
    *(["board", "--scene", name] for name in ("elbow", "", *CELLS)),
    ["board", "--symlink", "/no/folder/x"],
    ["build", "elbow"],
    ["build", ""],
    ["flash", "elbow"],
    ["flash", "icestick"],
    ["flash", "icestick", "FOLDER"],
    *(["replay", name] for name in ("elbow", "", *CELLS)),
    ["replay", "NAN", "--threshold", "1"],
    ["replay", "COMPLEX", "--threshold", "1"],
    ["replay", "FLOATS", "--connectivity", "6"],
    ["cover", "impact", *ARM.split()],
    [*SENSE],
    [*SENSE, "--pitch", "10"],
    [*SENSE, "--offset", "0", "--switch-area", "12.6"],
    *(["cover", "design", f"{name}.toml" if name in ("DEEP", "FIFO") else name] for name in TOML),
    ["cover", "figures", "--case", "NONE"],
    ["cover", "figures", "--data", "NONE"],
    ["cover", "figures", "--data", "FIFO"],
    ["cover", "figures", "--data", "BINARY"],
    ["study", "chart", "--method", "guess"],
    ["study", "chart", "--family", "guess"],
    ["study", "chart", "--jobs", "0"],
    ["fit", "bumper", "--placements", "1"],
    ["record", "x.mcap", "sim://", "--seconds", "0"],
    *(["fit", f"{name}.toml"] for name in TOML if name not in ("/dev/zero", "NONE")),
    *(["fit", name] for name in ("elbow", "", "/dev/zero", *CELLS)),
    *(["study", "arm", "--case", f"{name}.toml"] for name in TOML if name not in ("/dev/zero", "NONE")),
    ["study", "arm", "--case", "elbow"],
    [],
    ["elbow"],
    ["zones", "--elbow"],
]


@pytest.mark.parametrize("arguments", CASES, ids=" ".join)
def test_what_cannot_be_is_refused(arguments, run):
    status, errors = run(*arguments)
    refused(status, errors)


WITH_SKIN = [[*called(leaf), "--skin", name] for leaf in leaves() if "--skin" in options(leaf) for name in TOML]


@pytest.mark.parametrize("arguments", WITH_SKIN, ids=" ".join)
def test_a_skin_that_cannot_be_is_refused(arguments, run, tmp_path):
    np.save(tmp_path / "frames.npy", np.zeros((1, 4, 4), bool))
    refused(*run(*arguments))


def test_a_recording_is_not_emptied_by_its_own_replay(run, files):
    before = files["RECORDED"].read_bytes()
    status, errors = run("zones", "--json", "replay://RECORDED", "--record", "RECORDED")
    assert "is there already; name a new file" in refused(status, errors)
    assert files["RECORDED"].read_bytes() == before


@pytest.mark.parametrize(
    ("name", "old", "new"),
    [
        ("cover", "thickness_m = 0.005", "thickness_m = 5"),
        ("design", "thickness_m = ", "thickness_m = 5 #"),
        ("design", "pitch_m = ", "pitch_m = 10 #"),
    ],
)
def test_millimeters_are_told_from_meters(tmp_path, run, name, old, new):
    assert "lengths are in m, 5 mm is 0.005" in refused(*run(*SENSE, "--offset", "5", "--thickness", "5"))
    command, text = BASES[name]
    assert old in text
    (tmp_path / "file.toml").write_text(text.replace(old, new, 1))
    assert "it must be a length in m, at most 1; 5 mm is 0.005" in refused(*run(*command, str(tmp_path / "file.toml")))


# ---- every numeric option of every command


def numeric_options():
    """(words of the command, option, how many) of every option that takes numbers."""
    found = []

    def walk(parser, words):
        for name, below in parser.topics.items():
            walk(below, [*words, name])
        for action in parser._actions:
            if action.type is not None and not action.choices:
                assert action.type not in (int, float), f"{words} {action.option_strings}: say a range"
                if action.dest not in ("joint", "measured"):  # a name and a number, which have tests of their own
                    found.append((words, action.option_strings[0], action.nargs or 1))

    walk(cli._parser(), [])
    return found


OPTIONS = numeric_options()
NEEDED = {"build": ["icestick"], "replay": ["x.npy"], "fit": ["bumper"]}


def test_every_numeric_option_is_found():
    assert len(OPTIONS) > 100


REFUSALS = [(*option, text) for option in OPTIONS for text in NUMBERS]


@pytest.mark.parametrize(
    ("words", "option", "count", "text"),
    # For each option one or two numbers, not the same for the next.
    sample(REFUSALS, quick=REFUSALS[::7], slow=REFUSALS[::3]),
    ids=lambda value: " ".join(value) if isinstance(value, list) else str(value)[:20] or "empty",
)
def test_no_numeric_option_takes_what_is_no_number_in_its_range(words, option, count, text, run):
    status, errors = run(*words, *([f"{option}={text}"] if count == 1 else [option, "0", *[text] * (count - 1)]))
    assert status == 2
    if count > 1 and text == "-inf":  # which argparse takes for an option
        assert f"argument {option}: expected {count} arguments" in refused(status, errors)
        return
    assert f"argument {option}: '{text[:40]}" in refused(status, errors)
    assert " is not a " in errors


# ---- by chance


@pytest.fixture
def no_work(monkeypatch):
    """What is taken after all ends where work would begin."""

    def stop(*_, **__):
        raise native.CompileFailed("nothing is built in this test")

    monkeypatch.setattr(native, "load", stop)
    monkeypatch.setattr(pool, "executor", stop)
    monkeypatch.setattr(report, "columns", stop)


by_chance = settings(
    max_examples=30,
    derandomize=True,
    deadline=None,
    suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow],
)
texts = st.text(max_size=12).filter(lambda text: not {"\0"} & set(text))


@pytest.mark.timeout(120)
@pytest.mark.usefixtures("no_work")
@by_chance
@given(
    which=st.sampled_from(OPTIONS),
    bad=st.one_of(texts, st.floats().map(str), st.integers().map(str)),
    more=st.lists(texts, max_size=3),
)
@example(which=(["zones"], "--baud", 1), bad="0", more=[])
@example(which=(["doctor"], "--seconds", 1), bad="-1", more=[])
def test_random_words_never_end_in_a_traceback(which, bad, more, run):
    words, option, _ = which
    if words[0] not in NEEDED and words[0] not in ("cover", "settle") and words != ["study", "chart"]:
        more = ["NONE"]  # and no port of this machine
    run(*words, *NEEDED.get(words[0], []), f"{option}={bad}", *more)


BASES = {
    "skin": [["zones", "sim://", "--skin"], (ROOT / "examples/icebreaker-64x64.toml").read_text()],
    "cover": [
        ["board", "--skin"],
        "rows = 8\n[cover]\nmodel = 'foam'\nthickness_m = 0.005\n[cover.switch]\n",
    ],
    "patch": [["board", "--skin"], "rows = 8\n[cover]\nshare = 0.5\n[cover.switch]\narea_m2 = 1e-5\n"],
    "design": [["cover", "design"], (ROOT / "examples/paper-second-design.toml").read_text()],
    "scenes": [["fit"], (ROOT / "examples/scenes-hands.toml").read_text()],
    "case": [["study", "arm", "--json", "--case"], (ROOT / "sim/contactfpga_sim/lab/arm/cases/paper.toml").read_text()],
}
ODD = [
    *("nan", "inf", "-inf", "-1", "0", "1e300", "1e-300", "9223372036854775807", "true", "''", "'x'", "'\\u001b[31m'"),
    *("[]", "[[]]", "[1, 'x']", "[[0, 0]]", "[nan, nan]", "{}", "{a = 1}", "1979-05-27", "07:32:00", "[{}]", "[true]"),
]


def places(values, above=()):
    """Path of every value in nested tables."""
    for name, value in values.items() if isinstance(values, dict) else enumerate(values):
        yield (*above, name)
        if isinstance(value, dict | list):
            yield from places(value, (*above, name))


def written(value):
    """TOML of what tomllib read; a str in a list of one is TOML as it is."""
    if isinstance(value, Odd):
        return value.text
    if isinstance(value, dict):
        return "{" + ", ".join(f'"{name}" = {written(one)}' for name, one in value.items()) + "}"
    if isinstance(value, list):
        return "[" + ", ".join(map(written, value)) + "]"
    if isinstance(value, bool):
        return str(value).lower()
    return repr(value) if not isinstance(value, float) or math.isfinite(value) else str(value)


class Odd:
    """Stands where a value was."""

    def __init__(self, text):
        self.text = text


@pytest.mark.timeout(120)
@pytest.mark.usefixtures("no_work")
@pytest.mark.parametrize("name", BASES)
@by_chance
@given(data=st.data())
def test_random_values_in_files_never_end_in_a_traceback(name, data, run, files):
    command, text = BASES[name]
    values = tomllib.loads(text)
    for _ in range(data.draw(st.integers(1, 2))):
        *above, last = data.draw(st.sampled_from(list(places(values))))
        odd = Odd(data.draw(st.sampled_from(ODD)))
        table = values
        for step in above:
            if isinstance(table, Odd):
                break
            table = table[step]
        if not isinstance(table, Odd):
            table[last] = odd
    path = files["NONE"].parent / f"random-{name}.toml"
    path.write_text("\n".join(f"{key} = {written(value)}" for key, value in values.items()))
    tomllib.loads(path.read_text())
    status, errors = run(*command, str(path))
    if status not in (0, 3):
        refused(status, errors)


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("gear = ", "gear = 1e300 #"),
        ("thickness_m = ", "thickness_m = 1e-300 #"),
        ("period_s = ", "period_s = 1e-300 #"),
        ("[foam]", "[run]\nstep_s = 1e-9\n[foam]"),
        ("[foam]", "[run]\nduration_s = 1e6\n[foam]"),
    ],
)
def test_a_case_that_cannot_be_computed_is_refused(tmp_path, run, old, new):
    text = (ROOT / "sim/contactfpga_sim/lab/arm/cases/paper.toml").read_text()
    assert old in text
    (tmp_path / "case.toml").write_text(text.replace(old, new, 1))
    assert "it must" in refused(*run("study", "arm", "--json", "--case", str(tmp_path / "case.toml")))


def test_a_case_that_is_like_itself_is_refused(tmp_path, run):
    path = tmp_path / "case.toml"
    path.write_text(f"like = {str(path)!r}")
    assert "it must name another case" in refused(*run("study", "arm", "--case", str(path)))


@pytest.mark.timeout(120)
@pytest.mark.usefixtures("no_work")
@pytest.mark.parametrize("suffix", ["npy", "npz", "bin"])
@by_chance
@given(data=st.data())
def test_random_bytes_in_files_never_end_in_a_traceback(suffix, data, run, files):
    path = files["NONE"].parent / f"random.{suffix}"
    frames = np.zeros((4, 4, 4), bool)
    if suffix == "npy":
        np.save(path, frames)
    elif suffix == "npz":
        np.savez(path, pressed=frames, rate_hz=50.0)
    else:
        path.write_bytes(files["RECORDED"].read_bytes())
    raw = bytearray(path.read_bytes())
    for _ in range(data.draw(st.integers(1, 4))):
        raw[data.draw(st.integers(0, len(raw) - 1))] = data.draw(st.integers(0, 255))
    path.write_bytes(raw[: data.draw(st.integers(0, len(raw)))] if data.draw(st.booleans()) else raw)
    commands = [["zones", "--json", f"replay://{path}"]]
    if suffix != "bin":
        commands = [["replay", str(path)], ["fit", str(path)], ["zones", "--json", f"sim://?scene={path}"]]
    for command in commands:
        status, errors = run(*command)
        if status != 0:
            refused(status, errors)
