"""Where results are written is looked at before the work."""

import os

import pytest
from every_command import called, leaves, options

from contactfpga.tools.console import outputs
from contactfpga_sim.apps import pool


@pytest.fixture
def worked(monkeypatch):
    """Counts the pools of workers that were made."""
    made = []
    right = pool.executor
    monkeypatch.setattr(pool, "executor", lambda *args: made.append(args) or right(*args))
    return made


def places(tmp_path):
    """Where nothing can be written, whoever asks."""
    (tmp_path / "file").touch()
    return {"a file": tmp_path / "file", "below a file": tmp_path / "file" / "below", "a device": "/dev/null/x"}


INTO_A_FOLDER = [
    leaf for leaf in leaves() if "--output" in options(leaf) and options(leaf)["--output"].metavar == "DIR"
]
COMMANDS = {leaf.prog: called(leaf) for leaf in INTO_A_FOLDER} | {
    "contactfpga build": ["build", "icebreaker"],
}


def test_each_command_with_an_output_takes_the_short_option():
    written = [options(leaf) for leaf in leaves() if "--output" in options(leaf)]
    assert len(written) > 10
    assert all(found.get("-o") is found["--output"] for found in written)


@pytest.mark.parametrize("where", ["a file", "below a file", "a device"])
@pytest.mark.parametrize("name", COMMANDS)
def test_a_folder_that_cannot_be_is_refused_before_the_work(name, where, tmp_path, worked, run):
    place = places(tmp_path)[where]
    status, out, errors = run(*COMMANDS[name], "--output", place)
    assert (status, out, errors.count("\n")) == (1, "", 1)
    assert "--output is" in errors
    assert str(place) in errors
    assert worked == []


def test_a_file_that_cannot_be_is_refused_before_the_work(tmp_path, worked, run):
    for place in (tmp_path, "/dev/null/skin.toml"):
        assert "--output is" in run("fit", "examples/scenes-bumper.toml", "--output", place)[2]
    assert worked == []


def test_a_place_that_can_be_is_made_and_nothing_is_left_in_it(tmp_path):
    assert outputs.folder(tmp_path / "a" / "b").is_dir()
    assert os.listdir(tmp_path / "a" / "b") == []
    assert outputs.file(tmp_path / "c" / "d.toml") == tmp_path / "c" / "d.toml"
    assert os.listdir(tmp_path / "c") == []
    (tmp_path / "kept").write_text("as it was")
    outputs.file(tmp_path / "kept")
    assert (tmp_path / "kept").read_text() == "as it was"


def test_a_file_is_named_as_it_was_asked_for(tmp_path):
    """And not as the folder that cannot be."""
    (tmp_path / "file").touch()
    with pytest.raises(outputs.OutputError) as caught:
        outputs.file(tmp_path / "file" / "x.csv", "OUT")
    assert str(caught.value) == f"OUT is '{tmp_path}/file/x.csv'; '{tmp_path}/file' is no folder"
    with pytest.raises(
        outputs.OutputError, match=r"OUT is '/dev/null/below/x.csv', which cannot be written: Not a dir"
    ):
        outputs.file("/dev/null/below/x.csv", "OUT")
