"""Keys of compiled boards and kept results: all that decides what they are, and nothing else."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from contactfpga_sim.model.board import sources

ROOT = Path(__file__).parents[2]
PACKAGES = {"contactfpga": "py", "contactfpga_hdl": "hdl", "contactfpga_sim": "sim"}

# The package's own file gathers names for users; without it only those modules are there that something needs.
LOADED = """
import sys, types
from pathlib import Path
stub = types.ModuleType("contactfpga")
stub.__path__ = [sys.argv[1]]
sys.modules["contactfpga"] = stub
from amaranth.back import rtlil
from contactfpga.skin import Skin
from contactfpga.skin.several import Several
from contactfpga_hdl.several import SeveralTop
from contactfpga_hdl.top import Top

small = Skin(rows=3, columns=3)
fast = small.replace(scan="reversal", precharge_us=0.5)
chains = {"row_drive": "74hc595", "column_read": "74hc165", "settle_us": 20.0, "fail_safe": True}
round = {"surface": "cylinder", "radius_mm": 20.0, "closed": True}
skins = [
    fast.replace(debounce="sym_defer_pk", dual=True),
    small.replace(labeller="projection", guard=True, alive=True, units=3, converter="mcp3208"),
    small.replace(labeller="single", debounce="asym_eager_defer_pk", units=2, converter="ads131m08"),
    fast.replace(guard=True, self_test=True, labeller="serial", **round),
    fast.replace(report="barycenter", send="on_change", extent=True),
    small.replace(guard=True, precharge_us=0.5, ruler=12),
    small.replace(guard=True, precharge_us=0.5, ruler=12, harder=(3,), report="cells"),
    small.replace(report="cells", row_order=(2, 1, 0), baud=4_000_000),
]
for skin in skins:
    rtlil.convert(Top(skin, probes=True), name="top")
rtlil.convert(SeveralTop(Several((small.replace(**chains),) * 2)), name="top")
for name, module in sorted(sys.modules.items()):
    if name.split(".")[0] in ("contactfpga", "contactfpga_hdl") and module is not stub:
        print(module.__file__)
"""

# Prints a key for each of the files it is told, each changed in turn, and first the one of all as they are.
KEYS = """
import functools, sys
from pathlib import Path
from contactfpga.skin import Skin
from contactfpga_sim.model.board import native, sources
sources._imported = functools.cache(sources._imported)  # it knows the text only
for line in ["", *sys.stdin.read().splitlines()]:
    file = Path(line) if line else None
    if file:
        before = file.read_bytes()
        file.write_bytes(before + b"#")
    sources._taken.clear()
    sources._undocumented.cache_clear()
    sources.texts.cache_clear()
    print(eval(sys.argv[1], {"native": native, "skin": Skin()}))
    if file:
        file.write_bytes(before)
assert "amaranth" not in sys.modules
"""
SIZING = ("sizes.py", "pnr_report.py", "synthesis.py", "tools.py")
BOARD = "native.skin_key(skin)"
CARRIED = "__import__('contactfpga_sim.model.board.compiled', fromlist=['']).carried_key(skin)"


@pytest.fixture(autouse=True)
def _own_memory(monkeypatch):
    """What is changed here is nothing that other tests have read."""
    monkeypatch.setattr(sources, "_taken", {})
    monkeypatch.setattr(sources, "_read", {})


@pytest.fixture(scope="module")
def copy(tmp_path_factory):
    """A copy of all sources, which the test may change."""
    folder = tmp_path_factory.mktemp("copy")
    for package, inside in PACKAGES.items():
        ignored = shutil.ignore_patterns("__pycache__")
        shutil.copytree(ROOT / inside / package, folder / inside / package, ignore=ignored)
    return folder


def run(folder, code, *arguments, said="", **environment):
    """Output of Python with the packages of ``folder``."""
    path = os.pathsep.join(str(folder / inside) for inside in PACKAGES.values())
    environment = os.environ | {"PYTHONPATH": path, "PYTHONDONTWRITEBYTECODE": "1"} | environment
    command = [sys.executable, "-c", code, *map(str, arguments)]
    done = subprocess.run(
        command, cwd=folder, env=environment, input=said, capture_output=True, text=True, timeout=300, check=False
    )
    assert done.returncode == 0, done.stderr
    return done.stdout.splitlines()


def keys(folder, expression, files):
    """The key as things are, and by file the one when it is changed."""
    first, *others = run(folder, KEYS, expression, said="\n".join(map(str, files)))
    return first, dict(zip(files, others, strict=True))


@pytest.fixture(scope="module")
def loaded(copy):
    """Files that Python itself loads to elaborate the gateware."""
    return [Path(line) for line in run(copy, LOADED, copy / "py/contactfpga")]


@pytest.mark.slow
def test_python_loads_all_gateware_but_that_of_boards(copy, loaded):
    gateware = copy / "hdl/contactfpga_hdl"
    core = {gateware / "core.py", gateware / "link" / "records.py"}  # for other designs
    no_board = core | {*(gateware / "board").rglob("*.py")}  # of pins and bitstreams
    there = {*gateware.rglob("*.py")} - no_board
    assert there <= set(loaded)


@pytest.mark.slow
def test_each_file_that_python_loads_for_the_gateware_changes_the_key_of_a_board(copy, loaded):
    now, changed = keys(copy, BOARD, loaded)
    assert [str(file) for file, key in changed.items() if key == now] == []
    assert len(set(changed.values())) == len(loaded)
    for named in ("derived", "checks", "sheet"):
        assert copy / f"py/contactfpga/skin/{named}.py" in changed


@pytest.mark.slow
def test_each_file_that_python_loads_for_one_sheet_changes_the_key_of_a_carried_board(copy, loaded):
    drivers = copy / "sim/contactfpga_sim/model/board/drivers"
    now, changed = keys(copy, CARRIED, [*loaded, *drivers.glob("*.h"), drivers / "board.cpp"])
    left = {str(file.relative_to(copy)) for file, key in changed.items() if key == now}
    assert left == {"py/contactfpga/skin/several.py", "hdl/contactfpga_hdl/several.py"}


def test_a_file_that_the_gateware_does_not_need_leaves_the_key(copy):
    others = [
        *(
            "py/contactfpga/driver/board.py",
            "py/contactfpga/tracking/tracker.py",
            "py/contactfpga/design/cover/hertz.py",
        ),
        *("py/contactfpga/tools/cli.py", "py/contactfpga/skin/latency.py", "py/contactfpga/zones/zone.py"),
        *("sim/contactfpga_sim/model/golden/reversal.py", "sim/contactfpga_sim/lab/writer.py"),
    ]
    now, changed = keys(copy, BOARD, [copy / name for name in others])
    assert [str(file) for file, key in changed.items() if key != now] == []


BUILT = """native._cache_key(__import__('contactfpga_sim.model.board.compiled', fromlist=['']).model_of(skin),
    native.find_compiler())"""


def test_what_a_library_is_compiled_from_changes_its_key(copy):
    drivers = copy / "sim/contactfpga_sim/model/board/drivers"
    taken = [*drivers.glob("*.h"), drivers / "board.cpp", drivers.parent / "native.py"]
    others = [drivers / "label.cpp", drivers.parent / "receiver.py"]
    now, changed = keys(copy, BUILT, [*taken, *others])
    assert len(taken) > 5
    assert [file.name for file, key in changed.items() if key == now] == [file.name for file in others]


@pytest.mark.slow  # the kept results are those of studies, whose tests `make test` leaves out
@pytest.mark.parametrize(
    ("module", "files"),
    [
        (
            "contactfpga_sim.lab.flips.campaign",
            [
                "flips/touches.py",
                "flips/flip.py",
                "../model/board/drivers/state.h",
                "../../../hdl/contactfpga_hdl/top.py",
            ],
        ),
        ("contactfpga_hdl.board.sizes", ["../../../hdl/contactfpga_hdl/board/" + name for name in SIZING]),
    ],
)
def test_what_a_kept_result_is_worked_out_by_changes_its_key(copy, module, files):
    key = f"__import__('contactfpga_sim.apps.result_cache', fromlist=['']).made_by({module!r})"
    paths = [(copy / "sim/contactfpga_sim/lab" / name).resolve() for name in files]
    page = copy / "sim/contactfpga_sim/lab/flips/tables.py"
    now, changed = keys(copy, key, [*paths, page])
    assert [file for file, key in changed.items() if key == now] == [page]


def test_a_docstring_changes_no_kept_result(tmp_path, monkeypatch):
    monkeypatch.setattr(sources, "folders_of", lambda packages: {"package": tmp_path})
    text = '"""Of what."""\n\nWIDTH = 3\n"""How wide."""\n\n\ndef f():\n    """Say so."""\n    return """so"""\n'
    quiet = 'WIDTH = 3\ndef f():\n    return """so"""\n'
    louder = text.replace("How wide.", "How wide it is,\n\nin cells.").replace("Say so.", "Return so.")

    def key(text):
        (tmp_path / "package.py").write_text(text)
        sources._taken.clear()
        sources._undocumented.cache_clear()
        return sources.digest("package", documented=False)

    assert key(text) == key(quiet) == key(louder)
    assert len({key(text), key(text.replace("3", "4")), key(text.replace('"""so"""', '"""no"""'))}) == 3


def test_files_of_ones_own_count_with_what_they_import_from_beside_them(tmp_path):
    texts = {"lab.py": "import helper\nfrom parts import one", "helper.py": "", "parts/one.py": "from . import two"}
    texts |= {"parts/two.py": "", "parts/__init__.py": "", "unused.py": ""}
    (tmp_path / "parts").mkdir()
    for name, text in texts.items():
        (tmp_path / name).write_text(text)
    before = sources.own([tmp_path / "lab.py"])
    assert before == sources.own([tmp_path / "lab.py"]) != sources.own([])
    for name in texts:
        (tmp_path / name).write_text(texts[name] + "\n")
        assert (sources.own([tmp_path / "lab.py"]) != before) == (name != "unused.py"), name
        (tmp_path / name).write_text(texts[name])


def test_code_that_changed_while_it_ran_is_seen(tmp_path, monkeypatch):
    (tmp_path / "moving.py").write_text("x = 1")
    monkeypatch.setattr(sources, "folders_of", lambda packages: {"moving": tmp_path})
    before = sources.digest("moving")
    assert not sources.changed()
    (tmp_path / "moving.py").write_text("x = 2")
    assert sources.digest("moving") == before
    assert sources.changed()


def test_another_compiler_version_or_option_is_another_library(tmp_path, monkeypatch):
    from contactfpga_sim.model.board import native

    def key(command):
        monkeypatch.setenv("CXX", command)
        native._said.cache_clear()
        return native._cache_key(native.Model("a sum", "label.cpp", "key", lambda: None), native.find_compiler())

    script = tmp_path / "cxx"
    script.write_text("#!/bin/sh\nsed -n 2p $0.version\n")
    script.chmod(0o755)
    found = set()
    for version in ("12.2.0-14", "12.2.0-15"):
        (tmp_path / "cxx.version").write_text(f"g++\n{version}\n")
        found |= {key(str(script)), key(f"{script} -O1")}
    assert len(found) == 4
    script.touch()
    assert key(str(script)) in found
    native._said.cache_clear()
