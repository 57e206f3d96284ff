"""`contactfpga ros`: what a user sees of it."""

import sys

import pytest

from contactfpga.tools import cli


def refused(capsys, *arguments):
    status = cli.main(["ros", *arguments])
    said = capsys.readouterr()
    assert "Traceback" not in said.err
    return status, said.err


def test_it_publishes_for_as_long_as_it_is_asked(board, capsys):
    pytest.importorskip("cyclonedds")
    board.stream = board.frame
    assert (
        cli.main(["ros", board.path, "--domain", "88", "--namespace", "arm", "--seconds", "0.3", "--timeout", "60"])
        == 0
    )
    assert "publishing /arm/zones and the other topics to this computer; Ctrl-C ends it" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["--namespace", "a b"], "namespace is 'a b'; it has letters, digits and _, and / between parts"),
        (["--frame", "a b"], "frame is 'a b'; a frame's name has letters, digits"),
        (["--parent", "/base"], "parent is '/base'; a frame's name has letters, digits, and _ / ~ . -, and begins"),
        (["--friction", "0.5"], "--friction needs --units: it is used for forces only"),
        (["--seconds", "1", "nowhere"], "nowhere cannot be opened"),
    ],
)
def test_what_cannot_be_is_refused_in_a_line(capsys, arguments, said):
    pytest.importorskip("cyclonedds")
    status, text = refused(capsys, "--domain", "88", *arguments)
    assert status == 1
    assert said in " ".join(text.split())


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["--origin-m", "0", "0", "nan"], "argument --origin-m: 'nan' is not a number from -100 to 100 m"),
        (["--zones-hz", "0"], "argument --zones-hz: '0' is not a number above 0 and at most 100000 Hz"),
    ],
)
def test_numbers_out_of_range_are_refused_as_they_are_read(capsys, arguments, said):
    with pytest.raises(SystemExit) as ended:
        cli.main(["ros", *arguments])
    assert ended.value.code == 2
    assert said in " ".join(capsys.readouterr().err.split())


def test_units_of_a_board_that_has_none_are_refused(board, capsys, tmp_path):
    pytest.importorskip("cyclonedds")
    (tmp_path / "units.toml").write_text("[[unit]]\npoint_m = [0, 0, 0]\naxis = [0, 0, 1]\n")
    status, text = refused(
        capsys, board.path, "--domain", "88", "--timeout", "60", "--units", str(tmp_path / "units.toml")
    )
    assert (status, "this board has no pressure units" in text) == (1, True)


def test_the_missing_extra_is_named(capsys, monkeypatch):
    monkeypatch.setitem(sys.modules, "cyclonedds.domain", None)
    status, text = refused(capsys, "sim://")
    assert status == 1
    assert "contactfpga[ros]" in text or "'.[ros]'" in text
