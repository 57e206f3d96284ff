"""Files, recordings and ports of strangers name modules: none is imported unless the user says so."""

import base64
import dataclasses
import json
import sys
from typing import get_args

import numpy as np
import pytest
from every_command import called, leaves, options, positional

import contactfpga
from contactfpga import Skin, SkinError
from contactfpga.choices.choice import FIELDS, Choice
from contactfpga.robot.body import Body, BodyError
from contactfpga.skin.several import Several
from contactfpga.tools import cli

NAMED = "evil_module:x"
ESCAPED = [
    'labeller = "evil_module:x"',
    r'"l\u0061beller" = "evil_module\u003ax"',
    'scan = "evil_module.part:x.y"',
    'converter = "evil_module:"',
]


@pytest.fixture
def mark(tmp_path, monkeypatch):
    """A file that appears when ``evil_module`` is imported, which lies in the current folder and on the path."""
    mark = tmp_path / "imported"
    (tmp_path / "evil_module.py").write_text(f"open({str(mark)!r}, 'w').close()\n")
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(str(tmp_path))
    yield mark
    sys.modules.pop("evil_module", None)


@pytest.fixture
def skin(mark, tmp_path):
    """A Skin file that names the module."""
    file = tmp_path / "skin.toml"
    file.write_text(f'labeller = "{NAMED}"\n')
    return file


def test_every_field_that_may_name_a_module_is_judged():
    kinds = {field.name: get_args(field.type) for field in dataclasses.fields(Skin)}
    named = {
        name for name, of in kinds.items() if any(isinstance(kind, type) and issubclass(kind, Choice) for kind in of)
    }
    assert named == set(FIELDS)


@pytest.mark.parametrize("text", ESCAPED)
def test_a_skin_file_is_refused_however_it_writes_the_name(mark, tmp_path, text):
    (tmp_path / "skin.toml").write_text(text + "\n")
    with pytest.raises(SkinError, match=r"skin\.toml: \w+ is '.*:.*', a module .* --trust .* trust=True"):
        Skin.load("skin.toml")
    assert not mark.exists()


@pytest.mark.parametrize("field", FIELDS)
def test_a_name_without_a_colon_imports_nothing(mark, tmp_path, field):
    (tmp_path / "skin.toml").write_text(f'{field} = "evil_module"\n')
    with pytest.raises(SkinError, match=f"{field} is 'evil_module'; it must be one of"):
        Skin.load("skin.toml", trust=True)
    assert not mark.exists()


def test_with_trust_the_module_is_imported(mark, skin):
    with pytest.raises(SkinError, match="cannot be loaded: module 'evil_module' has no attribute 'x'"):
        Skin.load(skin, trust=True)
    assert mark.exists()


def test_what_the_owner_writes_in_python_is_imported(mark):
    with pytest.raises(SkinError, match="cannot be loaded"):
        Skin(labeller=NAMED)
    assert mark.exists()


def robot(folder, **link):
    """A robot of one link with this Skin file."""
    link = {"name": "arm", "skin": "skin.toml", "point_m": [0, 0, 0], "rpy_rad": [0, 0, 0]} | link
    file = folder / "robot.toml"
    file.write_text("[[links]]\n" + "".join(f"{key} = {json.dumps(value)}\n" for key, value in link.items()))
    return file


def test_open_and_sheets_and_robots_take_the_same_word(mark, skin, tmp_path):
    (tmp_path / "sheets.toml").write_text('sheets = ["skin.toml", "skin.toml"]\n')
    for read, refused in (
        (lambda trust: contactfpga.open("sim://", skin, trust=trust), SkinError),
        (lambda trust: contactfpga.open("sim://?skin=skin.toml", trust=trust), SkinError),
        (lambda trust: contactfpga.open("sim://?sheets=sheets.toml#0", trust=trust), SkinError),
        (lambda trust: Several.load("sheets.toml", trust), SkinError),
        (lambda trust: Body.load(robot(tmp_path), trust), BodyError),
    ):
        with pytest.raises(refused, match="--trust"):
            read(False)
        assert not mark.exists()
        with pytest.raises(refused, match="cannot be loaded"):
            read(True)
        assert mark.exists()
        mark.unlink()
        sys.modules.pop("evil_module")


def test_a_trusted_robot_opens_its_boards_with_trust(mark, tmp_path):
    (tmp_path / "skin.toml").write_text(Skin(rows=4, columns=4).to_toml())
    (tmp_path / "other.toml").write_text(f'labeller = "{NAMED}"\n')
    body = Body.load(robot(tmp_path, port="sim://?skin=other.toml"))
    assert not body.links["arm"].trust
    assert Body.load(robot(tmp_path, port="sim://?skin=other.toml"), trust=True).links["arm"].trust


NEEDED = {"build": ["icebreaker"], "bringup": ["--kit", "starter"]}
"""What a command wants besides, though its parser does not say so."""


def reading():
    """Each command that reads a Skin file, by name, with the arguments that make it read this one."""
    for leaf in leaves():
        command = called(leaf)
        command += NEEDED.get(command[0], [])
        assert "--trust" in options(leaf)
        if "--skin" in options(leaf):
            yield [*command, "--skin", "skin.toml"]
        if "--sheets" in options(leaf):
            yield [*command, "--sheets", "sheets.toml"]
        if any(action.dest == "robot" for action in positional(leaf)):
            yield command
        for action in positional(leaf):
            if action.dest in ("port", "ports"):
                yield [*command, "sim://?skin=skin.toml"]
        if leaf.prog.endswith((" record", " view")):
            yield [*command, "robot.toml"]


HEAVY = {"study", "fit", "ros", "build", "view"}  # each imports for a second and more


@pytest.mark.parametrize(
    "arguments",
    [pytest.param(one, id=" ".join(one), marks=[pytest.mark.slow] if one[0] in HEAVY else []) for one in reading()],
)
def test_every_command_refuses_and_says_what_to_do(mark, skin, tmp_path, capsys, arguments):
    robot(tmp_path)
    (tmp_path / "sheets.toml").write_text('sheets = ["skin.toml", "skin.toml"]\n')
    (tmp_path / "points.toml").write_text("")
    np.save(tmp_path / "frames.npy", np.zeros((1, 4, 4), bool))
    assert cli.main(arguments) == 1
    assert not mark.exists()
    said = "".join(capsys.readouterr())
    assert "skin.toml: labeller is 'evil_module:x', a module that would be imported" in said
    assert "--trust" in said
    # With the flag the module is imported, which then lacks the attribute.
    assert cli.main([*arguments, "--trust"]) == 1
    assert mark.exists()
    assert "cannot be loaded: module 'evil_module' has no attribute 'x'" in "".join(capsys.readouterr())


def test_the_texts_of_a_recording_import_nothing(mark, tmp_path, monkeypatch, capsys):
    pytest.importorskip("amaranth")
    pytest.importorskip("mcap")
    from contactfpga.recordings import Recording
    from contactfpga.robot.body import robot_texts

    evil = f'"l\\u0061beller" = "{NAMED}"\n'
    (tmp_path / "skin.toml").write_text(Skin().to_toml())
    robot(tmp_path, port="sim://?scene=fingertip")
    pack = robot_texts.pack
    with monkeypatch.context() as patched:
        patched.setattr(Skin, "to_toml", lambda skin: evil)
        patched.setattr(
            robot_texts, "pack", lambda path: pack(path) | {"links.0.skin": base64.b64encode(evil.encode()).decode()}
        )
        assert cli.main(["record", "out.mcap", "robot.toml", "--seconds", "0.05"]) == 0
    recording = Recording("out.mcap")
    assert recording.skins == {"arm": None}
    assert "<table" in recording._repr_html_()
    (texts,) = recording.texts(robot_texts.ROBOT)
    (tmp_path / "unpacked").mkdir()
    with pytest.raises(BodyError, match="--trust"):
        robot_texts.unpack(texts, tmp_path / "unpacked")
    assert cli.main(["export", "out.mcap", "out.npz"]) == 0
    assert cli.main(["record", "--recover", "out.mcap"]) == 0
    assert cli.main(["zones", "--once", "replay://out.mcap"]) == 0
    capsys.readouterr()
    assert cli.main(["view", "out.mcap"]) == 1
    assert "evil_module:x" in "".join(capsys.readouterr())
    assert not mark.exists()
