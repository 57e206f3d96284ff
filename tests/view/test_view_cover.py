"""The mouse presses through the cover of a Skin's file: by its force, as anything else that touches."""

import pytest

import contactfpga
from contactfpga import Skin
from contactfpga.design.cover import cells_of, load_cover
from contactfpga.tools.view.fingers import Hand
from contactfpga_sim.model.board.virtual import board_at
from contactfpga_sim.model.scenes.contacts import Contact, disc
from contactfpga_sim.model.scenes.scene import Scene

pytest.importorskip("amaranth")

TILES = contactfpga.examples() / "tiles.toml"


def pressed(board, hand, force):
    hand.resize(force_n=force)
    board.advance(1)
    return board.pressed


def test_a_light_finger_of_the_mouse_closes_fewer_switches():
    with board_at(f"sim://?scene=nothing&skin={TILES}") as board:
        assert board.by_force
        hand = Hand.on(board, board.skin.sheet)
        hand.click(*(2.5 * 6.4,) * 2)  # between four
        counts = [int(pressed(board, hand, force).sum()) for force in (0.5, 2.5, 10.0)]
        assert counts == [0, 4, 4]
        wide = Scene((Contact(shape=disc(hand.radius_mm), x_mm=16.0, y_mm=16.0, force_n=10.0),))
        cells = cells_of(load_cover(TILES), 16, 16, 6.4e-3, 6.4e-3)
        assert (board.pressed == cells.closed(wide.loads(0.0))).all()


def test_a_bare_sheet_goes_by_the_place_alone():
    with board_at("sim://?scene=nothing", Skin(rows=4, columns=4)) as board:
        assert not board.by_force
        hand = Hand.on(board, board.skin.sheet)
        hand.click(10.0, 10.0)
        assert (pressed(board, hand, 0.5) == pressed(board, hand, 20.0)).all()
        assert board.pressed.sum() == 1


def test_a_file_of_a_skin_alone_has_its_cover_in_the_view():
    pytest.importorskip("viser")
    from contactfpga.tools.view import opening

    source, hand = opening._source(opening.ViewRequest(skin=TILES, timeout=60))
    try:
        assert hand.board.by_force
        assert source.sheet.pitch_x_mm == 6.4
    finally:
        source.close()


def test_a_recording_with_a_threshold_leaves_the_mouse_its_cover(tmp_path):
    import numpy as np

    np.save(tmp_path / "frames.npy", np.zeros((1, 16, 16)))
    with board_at(f"sim://?scene={tmp_path}/frames.npy&threshold=1&skin={TILES}") as board:
        hand = Hand.on(board, board.skin.sheet)
        hand.click(16.0, 16.0)
        assert pressed(board, hand, 0.5).sum() == 0
        assert pressed(board, hand, 10.0).sum() == 4


def test_the_scene_that_pushes_closes_switches_where_its_force_is():
    """18 N on one finger, which covers many switches, and 2 N on the other; half a second later the other way round."""
    with board_at(f"sim://?scene=pushing&skin={TILES}") as board:
        board.advance(board.skin.clock_hz // 2)
        hard, light = (part.sum() for part in (board.pressed[:8], board.pressed[8:]))
        assert hard > 4 * light > 0
        board.advance(1)
        light, hard = (part.sum() for part in (board.pressed[:8], board.pressed[8:]))
        assert hard > 4 * light > 0
