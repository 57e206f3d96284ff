"""Columns that fall through resistive cells, on the compiled board, and the example's file from force to frame.

What only this kills: a row sampled at another multiple of the ruler than asked for, times at the wrong crossing, noise
or edges of another size, forces that do not become readings, and levels of force that do not become zones.
"""

import json
import math
import re

import numpy as np
import pytest

import contactfpga
from contactfpga.design.cover import load_cover
from contactfpga.shipped import examples
from contactfpga.skin import Skin
from contactfpga.tools import cli
from contactfpga.zones.batch import Batch
from contactfpga_sim.model.board.compiled import CompiledBoard
from contactfpga_sim.model.board.receiver import Receiver
from contactfpga_sim.model.scenes.scene import palm

SKIN = Skin(rows=3, columns=4, ruler=24, report="cells", guard=True, precharge_us=1, release_us=2, settle_us=30,
            row_order=(2, 0, 1), column_order=(1, 3, 0, 2))  # fmt: skip
END, THRESHOLD = 0.9, 0.6


def read(clocks, frames, noise=(0.0, 0.0, 0.0, 0.0), skin=SKIN):
    """(frames, rows, columns) cells, or levels, of a board whose columns fall in these (row lines, column lines)
    clocks."""
    with CompiledBoard(skin) as board:
        board.fall(clocks / skin.clock_hz, END, THRESHOLD)
        board.disturb(*noise)
        board.hold(np.ones((1, skin.rows, skin.columns), bool), (frames + 2) * skin.derived.frame_clocks)
        received = board.take("received")
    stream = zip(received["cycle"].tolist(), received["data"].tolist())
    sent = [one.frame for one in Receiver(skin).take(stream)][1 : frames + 1]
    return np.array([one.bitmap if one.levels is None else one.levels for one in sent])


@pytest.mark.parametrize("ruler", [37.0, 101.0])
def test_a_cell_reads_pressed_if_it_falls_within_the_multiple_of_the_rulers_time(ruler):
    clocks = np.random.default_rng(int(ruler)).uniform(2.0, 300.0, (SKIN.row_lines, SKIN.column_lines))
    clocks[-1], clocks[:-1, -1] = [0.9 * ruler, ruler, 0.8 * ruler, 0.9 * ruler, np.inf], ruler
    cells, sample = clocks[:-1, :-1], 24 / 16 * ruler
    assert 0.2 < (cells < sample).mean() < 0.9
    sure = np.abs(cells - sample) > 3
    assert (read(clocks, 5)[:, sure] == (cells < sample)[sure]).all()


def test_a_cell_has_each_level_by_whose_multiple_of_the_rulers_time_it_fell():
    """Also a cell that leaks and never charges, one that is open, and a ruler that is lost: all samples are late."""
    skin, ruler = SKIN.replace(ruler=48, harder=(20, 7)), 90.0
    clocks = np.random.default_rng(3).uniform(2.0, 340.0, (skin.row_lines, skin.column_lines))
    clocks[-1], clocks[:-1, -1] = [0.9 * ruler, ruler, 0.8 * ruler, 0.9 * ruler, np.inf], ruler
    clocks[0, 0], clocks[1, 1] = 0.01, np.inf
    cells, samples = clocks[:-1, :-1], np.array([48, 20, 7]) / 16 * ruler
    reached = (cells < samples[:, None, None]).sum(axis=0)
    assert {*reached.flat} == {0, 1, 2, 3}
    sure = (np.abs(cells - samples[:, None, None]) > 3).all(axis=0)
    assert (read(clocks, 4, skin=skin)[:, sure] == reached[sure]).all()
    clocks[-1] = np.inf
    late = np.abs(cells - 360) > 3
    assert (read(clocks, 4, skin=skin)[2:, late] == 3 * (cells < 360)[late]).all()


def test_noise_and_edges_turn_as_many_readings_as_they_should():
    """The ruler's noise moves a frame's samples as much as the cell's own, as both have the same share of their way to
    go: a level a standard deviation of the noise from the threshold reads wrong in 24 % of samples."""
    clocks, frames = np.full((SKIN.row_lines, SKIN.column_lines), 60.0), 2_000
    clocks[-1] = [60.0, 40.0, 40.0, 40.0, np.inf]
    sampled, sigma = 90.0, 0.01
    for column, away in enumerate((-2.0, -1.0, 0.0, 1.0)):
        share = THRESHOLD - away * sigma  # of the way, at the sample
        clocks[:-1, column] = sampled * math.log1p(-THRESHOLD / END) / math.log1p(-share / END)
    pressed = read(clocks, frames, (sigma, 0.0, 0.0, 0.0)).mean(axis=(0, 1))
    usual = [(1 + math.erf(-away / 2)) / 2 for away in (-2.0, -1.0, 0.0, 1.0)]
    assert pressed == pytest.approx(usual, abs=0.06)  # a clock is 0.4 of the noise's deviation
    assert (np.diff(pressed) < -0.02).all()
    clocks[:-1, :-1] = 87.0
    for lasts_s, period_s in ((20e-6, 73e-6), (5e-6, 73e-6)):
        missed = 1 - read(clocks, 1_500, (0.0, -0.06, lasts_s, 1 / period_s)).mean()
        hit = lasts_s / period_s
        assert hit * (1 - hit) - 0.05 < missed < hit + 0.02  # an edge at the ruler moves the sample beyond the next one


@pytest.mark.slow
def test_the_example_reads_a_palm_by_its_forces_and_tells_its_rest(capsys):
    file = examples() / "cells.toml"
    skin, cover = Skin.load(file), load_cover(file)
    levels = palm(skin).forces_n(0.0, skin, cover) / cover.cell.level_n
    with contactfpga.open(f"sim://?scene=palm&skin={file}", timeout=30.0) as board:
        cells, lighter = board.read().cells, board.sample_at(20).cells
    assert cells[levels > 1.5].all()
    assert not cells[levels < 1 / 1.5].any()
    assert lighter.sum() > cells.sum() > 40
    untouched = ["--skin", str(file), f"sim://?scene=nothing&skin={file}"]
    assert cli.main(["wire", "--rest", "--json", "--seconds", "0.1", *untouched]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert (answer["lightest"], answer["levels"]) == (None, [[None] * 16] * 16)
    assert cli.main(["wire", "--settle", *untouched]) == 1
    assert "take --rest" in capsys.readouterr().err


@pytest.mark.slow
def test_the_example_of_levels_reads_a_palm_by_its_forces():
    """A palm's levels follow its forces, contacts carry their mean level, and each level moves alone."""
    file = examples() / "levels.toml"
    skin, cover = Skin.load(file), load_cover(file)
    forces = palm(skin).forces_n(0.0, skin, cover)
    with contactfpga.open(f"sim://?scene=palm&skin={file}", timeout=60.0) as board:
        zones = board.read()
        lighter = board.sample_at(3, level=2)
        with pytest.raises(ValueError, match="level 4 at 3; it has 3 levels, at 0 to 255"):
            board.sample_at(3, level=4)
    for level, force_n in enumerate((0.13, 0.52, 2.08), 1):
        assert (zones.levels[forces > 2.5 * force_n] >= level).all()
        assert (zones.levels[forces < force_n / 2.5] < level).all()
    assert ((zones.levels > 0) == zones.cells).all()
    assert {*zones.levels.flat} == {0, 1, 2}
    assert (lighter.cells == zones.cells).mean() > 0.98
    assert (lighter.levels == 2).sum() < (zones.levels == 2).sum() / 2
    y, x = np.nonzero(zones.levels)
    (zone,), weight = zones, zones.levels[y, x]
    assert zone.pressure == pytest.approx(weight.mean())
    assert (zone.sum_x, zone.sum_y, zone.area_cells) == (x.sum(), y.sum(), len(x))
    assert zone.x_mm == pytest.approx(np.average(x, weights=weight) * skin.pitch_x_mm)
    assert zones.to_dict()["levels"] == zones.levels.tolist()
    (together,) = Batch.of([zones]).zones
    assert all(np.array_equal(together[name], zones.array[0][name]) for name in zones.array.dtype.names)


@pytest.mark.slow
def test_harder_levels_change_no_level_at_rest(capsys, tmp_path):
    """Under a palm, where cells of all forces are."""
    text, found = (examples() / "levels.toml").read_text(encoding="utf-8"), []
    for name, said in (("levels", text), ("one", re.sub(r"^harder = .*$", "", text, flags=re.MULTILINE))):
        file = tmp_path / f"{name}.toml"
        file.write_text(said, encoding="utf-8")
        assert cli.main(["wire", "--rest", "--json", "--skin", str(file), f"sim://?scene=palm&skin={file}"]) == 1
        found.append(np.array(json.loads(capsys.readouterr().out)["levels"], float))
    known = ~np.isnan(found)
    assert (known[0] != known[1]).sum() < 4 < 20 < known.all(axis=0).sum()  # one may be at the end of the settle time
    assert found[0][known.all(axis=0)] == pytest.approx(found[1][known.all(axis=0)], rel=0.04, abs=1)
