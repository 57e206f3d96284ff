"""What a newcomer is shown goes together: examples with the boards that they name, kits, what `--check` proposes."""

import json
import re
import shlex
import tomllib

import pytest

from contactfpga import Skin, examples
from contactfpga.boards import BOARDS
from contactfpga.boards.spec import BoardSpec
from contactfpga.design import buildable, kits
from contactfpga.design.circuit import Circuit, CircuitError, check, check_times, falling, load_circuit
from contactfpga.design.sheet.extract import extracted
from contactfpga.skin import SkinError
from contactfpga.tools import cli
from contactfpga_hdl.board import build

SIMULATED = {"fast.toml", "fast-64x64.toml"}
"""These say so in their first lines."""
SEVERAL = {"two-sheets": ("chest", "back"), "arm-sheets": ("forearm", "upper")}
SHEETS = {f"{of}-{sheet}.toml": f"{of}.toml" for of, sheets in SEVERAL.items() for sheet in sheets}
COMMAND = re.compile(r"^# +contactfpga (build .*)$", re.MULTILINE)


def skins():
    """Example files that hold a Skin."""
    for path in sorted(examples().rglob("*.toml")):
        if path.parent.name in ("examples", *kits.names()):
            values = tomllib.loads(path.read_text(encoding="utf-8"))
            if {"rows", "pitch_x_mm", "scan", "units", "row_drive"} & set(values):
                yield path


@pytest.mark.parametrize("path", [*skins()], ids=lambda path: str(path.relative_to(examples())))
def test_an_example_names_its_board_and_is_accepted_by_it(path, monkeypatch, capsys):
    if path.name in SIMULATED:
        assert "Simulated: no supported board" in path.read_text(encoding="utf-8")
        return
    shown = path.with_name(SHEETS.get(path.name, path.name)).read_text(encoding="utf-8")
    (command,) = COMMAND.findall(shown)
    monkeypatch.chdir(examples().parent)
    assert cli.main([*shlex.split(command), "--wiring"]) == 0
    assert "contact" in capsys.readouterr().out


def test_the_page_of_examples_has_each_file_with_a_command_that_is_one(capsys):
    page = (examples().parent / "docs/examples.md").read_text(encoding="utf-8")
    files = {path.relative_to(examples().parent).as_posix() for path in examples().rglob("*.*") if path.is_file()}
    assert {name for name in files if "__pycache__" not in name} == set(re.findall(r"`(examples/[\w./-]+)`[,| ]", page))
    commands = re.findall(r"\| `(\w+) ([^`]*)` \|$", page, re.MULTILINE)
    assert len(commands) == len(re.findall(r"^\| `", page, re.MULTILINE)) > 15
    for program, arguments in commands:
        if program == "contactfpga":
            cli._parser().parse_args(shlex.split(arguments))


@pytest.mark.parametrize("name", BOARDS)
def test_the_own_sheet_of_a_board_states_a_circuit_that_works(name):
    board = BOARDS[name]
    circuit = Circuit(**board.circuit)
    check(circuit, board.skin)
    check_times(circuit, board.skin)


@pytest.mark.parametrize("name", kits.names())
def test_a_kit_is_complete(name):
    kit = kits.kit(name)
    assert load_circuit(kit.skin_path) is not None
    assert not any(buildable.findings(kit.board, kit.skin, load_circuit(kit.skin_path)).values())
    assert kit.skin == Skin.load(kit.skin_path), "the host reads the file without a board"
    assert all(part.count > 0 and part.what for part in kit.parts)
    assert (kit.skin.guard, kit.skin.alive, kit.skin.fail_safe) == (True, True, True)


@pytest.mark.parametrize("name", kits.names())
def test_the_circuit_that_a_kit_states_covers_that_of_its_sheet(name):
    """Lines of the layout, with 0.3 m of cable, are no slower than the Skin's times were chosen for."""
    kit = kits.kit(name)
    stated = load_circuit(kit.skin_path)
    found = extracted(kit.layout, 0.3).circuit
    for value in ("line_pf", "crossing_pf", "neighbor_pf", "line_ohm"):
        assert getattr(stated, value) >= getattr(found, value) > 0, value
    check_times(found, kit.skin)
    if found.falling:
        falling.check(found, kit.skin)


def test_a_kit_that_is_not_there_is_reported_with_those_that_are(capsys):
    assert cli.main(["build", "--kit", "huge"]) == 1
    assert "'huge' is no kit; take one of fast, soft, starter" in capsys.readouterr().err
    assert cli.main(["build", "icestick", "--kit", "starter"]) == 1
    assert "the kit 'starter' is for icebreaker, not icestick" in capsys.readouterr().err
    assert cli.main(["build"]) == 1
    assert "name a board, icebreaker," in capsys.readouterr().err
    assert cli.main(["settle", "--kit", "fast", "--skin", "x.toml"]) == 1
    assert "give --skin or --kit, not both" in capsys.readouterr().err


def test_a_skin_that_names_no_clock_and_no_baud_takes_its_boards(tmp_path):
    plain, own = tmp_path / "plain.toml", tmp_path / "own.toml"
    plain.write_text("rows = 4\n")
    own.write_text("rows = 4\nclock_hz = 50_000_000\nbaud = 2_500_000\n")
    for board in BOARDS.values():
        assert (board.load(plain).clock_hz, board.load(plain).baud) == (board.skin.clock_hz, board.skin.baud)
        board.check_clock(board.load(plain))
        board.check_baud(board.load(plain))
        assert (board.load(own).clock_hz, board.load(own).baud) == (50_000_000, 2_500_000)


def test_build_refuses_times_that_are_too_short_for_the_circuit(tmp_path, capsys):
    path = tmp_path / "my.toml"
    path.write_text('row_drive = "74hc595"\nrelease_us = 2.0\n[circuit]\ncolumn_pull_ohm = 22_000\nline_pf = 50\n')
    assert cli.main(["build", "icebreaker", "--skin", str(path), "--wiring"]) == 1
    message = capsys.readouterr().err
    found = re.search(
        r"release_us = 2: too short for this circuit; release_us = ([0-9.]+) would do, 1.3 times", message
    )
    assert found
    assert cli.main(["settle", "--skin", str(path)]) == 3
    assert f"the Skin's release_us = 2: too short, {float(found[1]):.2f} needed" in capsys.readouterr().out
    path.write_text(path.read_text().replace("release_us = 2.0", f"release_us = {found[1]}"))
    assert cli.main(["build", "icebreaker", "--skin", str(path), "--wiring"]) == 0


WIDE = Skin(rows=20, columns=20)
CIRCUIT = Circuit(line_pf=50, column_pull_ohm=22_000)


@pytest.mark.parametrize("board", BOARDS.values(), ids=BOARDS)
@pytest.mark.parametrize(
    "skin",
    [
        WIDE,
        Skin(rows=16, columns=16, clock_hz=14_000_000, baud=2_000_000),
        Skin(rows=32, columns=16, precharge_us=0.25, guard=True),
        Skin(rows=8, columns=8, scan="reversal", precharge_us=0.25, clock_hz=24_000_000, baud=12_000_000),
    ],
    ids=["20x20", "a clock of no board", "guarded", "reversal"],
)
def test_what_is_proposed_is_accepted(board: BoardSpec, skin: Skin):
    """The proposal is judged by what a build asks, and changes nothing that was well."""
    try:
        changes = buildable.proposed(board, skin, CIRCUIT)
    except SkinError:
        changes = None
    if changes is None:
        assert skin.scan == "reversal" or skin.guard
        return
    changed = skin.replace(**changes)
    board.check(changed)
    check(CIRCUIT, changed)
    check_times(CIRCUIT, changed)
    wrong = buildable.findings(board, skin, CIRCUIT)
    assert ({"clock_hz", "baud"} & set(changes) != set()) == bool(wrong["clock"] or wrong["baud"])
    assert all(getattr(skin, name) != value for name, value in changes.items() if name != "baud" and name != "clock_hz")


def test_levels_that_cannot_work_are_not_mended_by_times():
    with pytest.raises(SkinError, match="column_pull_ohm"):
        buildable.proposed(BOARDS["icebreaker"], WIDE, Circuit(column_pull_ohm=1000))
    with pytest.raises(CircuitError, match="settle_us = 5: no time is enough"):
        check_times(Circuit(column_pull_ohm=2200, pin_ohm=85), WIDE)


@pytest.mark.slow
def test_check_answers_all_at_once(monkeypatch, tmp_path, capsys):
    """Size and speed are those of the build that it would be."""
    built = []

    def fake(skin, board, folder, seed):
        built.append(skin)
        return build.pnr_report.Report((562, 1280), 482, (1, 16), (791, 1280), 119.14, 12.0)

    monkeypatch.setattr(build, "build", fake)
    path = tmp_path / "my.toml"
    path.write_text("rows = 20\ncolumns = 20\n[circuit]\ncolumn_pull_ohm = 22_000\nline_pf = 50\n")
    assert cli.main(["build", "icebreaker", "--skin", str(path), "--check", "--json"]) == 3
    answer = json.loads(capsys.readouterr().out)
    assert list(answer["problems"]) == ["pins", "clock", "baud", "levels", "times"]
    assert answer["problems"]["pins"].startswith("20 rows and 20 columns take 20 + 20 wires")
    assert built == [Skin.load(path).replace(**answer["changes"])]
    assert cli.main(["build", "--kit", "starter", "--check"]) == 0
    assert "times        fits" in capsys.readouterr().out
