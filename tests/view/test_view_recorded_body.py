"""Recordings of a robot in the view: all links together, by the files that the recording holds."""

import shutil

import numpy as np
import pytest
from fake_board import wait_until
from recorded_stream import StreamPort
from two_links import FLAT, ROBOT, ROUND, state_of, with_units, write_robot

pytest.importorskip("viser")

from contactfpga.recordings import Recording, Session
from contactfpga.robot.body import Body, BodyError, robot_texts
from contactfpga.robot.body.snapshot import on_link
from contactfpga.tools.recordings import link_recorder
from contactfpga.tools.view import opening, picture
from contactfpga.tools.view.bodies import BodyPlayer, pushes
from contactfpga.tools.view.playback import Player

TIMES = "[[links]]\nlate_s = 0.2\nsilent_s = 0.4"


def record(folder, about=None):
    """The chest sends for 0.2 s, the arm for a second; both clocks, which boards that are simulated have of their own,
    begin at once, however late the program comes to each of them."""
    path = write_robot(folder)
    path.write_text(ROBOT.replace("[[links]]", TIMES))
    ports = {"arm": StreamPort(ROUND, frames=1000), "chest": StreamPort(FLAT, frames=200)}
    with pytest.MonkeyPatch.context() as changed:
        changed.setattr(link_recorder, "offset_ns", lambda *clocks: 10**18)
        with Session(folder / "x.mcap", bytes_only=True, about={"robot": about or robot_texts.pack(path)}) as session:
            for name, port in ports.items():
                session.add(port, name=name)
            session.start()
            wait_until(lambda: session.wait(0.005) or not any(port.left for port in ports.values()))
    return path


@pytest.fixture(scope="module")
def file(tmp_path_factory):
    """Recorded in a folder that is gone."""
    folder = tmp_path_factory.mktemp("recorded")
    (folder / "away").mkdir()
    record(folder / "away")
    shutil.move(folder / "away" / "x.mcap", folder / "x.mcap")
    shutil.rmtree(folder / "away")
    return folder / "x.mcap"


@pytest.fixture
def player(file, clock):
    player = BodyPlayer(Recording(file), clock=clock)
    yield player
    player.close()


def test_all_links_play_together(file, player):
    every = list(Recording(file).frames())
    for _ in range(5):
        states = player.states()
        for name, state in states.items():
            wanted = [(t_s, zones) for t_s, link, zones in every if link == name and t_s <= player.position_s][-1]
            assert state.status == "ok"
            assert state.zones.to_dict() == wanted[1].to_dict()
            assert state.age_s == pytest.approx(player.position_s - wanted[0])
    assert player.position_s == pytest.approx(0.08)


@pytest.mark.parametrize(("seconds", "status"), [(0.1, "ok"), (0.44, "late"), (0.8, "silent")])
def test_a_link_of_which_nothing_came_has_no_data(player, seconds, status):
    player.states()
    player.pause()
    player.seek(seconds)
    states = player.states()
    assert (states["arm"].status, states["chest"].status) == ("ok", status)
    assert (states["chest"].zones is None) == (status == "silent")


def test_a_board_of_another_skin_is_a_mismatch(player):
    player.states()
    player.pause()
    player._newest["chest"] = player._newest["arm"]
    assert player.states()["chest"].status == "mismatch"


def test_where_sheets_lie_is_in_the_recording(file, player, tmp_path):
    (tmp_path / "again").mkdir()
    body = Body.load(write_robot(tmp_path / "again"))
    for name, plan in body.links.items():
        assert player.body.links[name].place(30.0, 50.0) == plan.place(30.0, 50.0)
    assert player.body.kinematics.joint_names == ("elbow",)


def test_tables_and_units_are_kept_too(tmp_path):
    path = with_units(write_robot(tmp_path))
    (tmp_path / "there").mkdir()
    body = robot_texts.unpack(robot_texts.pack(path), tmp_path / "there")
    np.testing.assert_array_equal(body.links["chest"].units.matrix, Body.load(path).links["chest"].units.matrix)


@pytest.mark.parametrize(
    ("change", "says"),
    [
        (lambda texts: texts.pop("links.1.skin"), "does not hold the robot's file 'links.1.skin'"),
        (lambda texts: texts.update(urdf="no base64!"), "the recording's robot cannot be read"),
        (lambda texts: texts.update(toml="= 3"), "the recording's robot cannot be read"),
        (lambda texts: texts.update(toml="links = [3]"), "the recording's robot cannot be read"),
    ],
)
def test_a_robot_that_is_not_whole_is_refused_in_one_line(tmp_path, change, says):
    texts = robot_texts.pack(write_robot(tmp_path))
    change(texts)
    with pytest.raises(BodyError, match=says):
        robot_texts.unpack(texts, tmp_path)


def unhurried(player):
    """As fast as it likes: on a busy machine it would stop short of the place that is looked for."""
    player._clock = lambda: player._stepped_s


def test_the_view_takes_the_robot_or_one_link(file, tmp_path):
    with opening.opened(opening.ViewRequest(str(file)), http_port=0) as shown:
        assert isinstance(shown.source, BodyPlayer)
        shown.source.pause()  # a busy machine would play on between two turns
        unhurried(shown.source)
        shown.source.seek(0.1)
        for _ in range(10):
            shown.view.step()
        text = shown.view._facts.content
        assert r"**arm** ok \(0\.00" in text
        assert "1 zone" in text
        chest = shown.view.stage.stages["chest"]
        assert chest._points.visible
        assert (chest._colors != picture.UNKNOWN).all()
        shown.source.seek(0.8)
        for _ in range(3):
            shown.view.step()
        assert not chest._points.visible, "what touched then is not drawn where nothing is known"
        assert (chest._colors == picture.UNKNOWN).all()
        assert shown.view._timeline._player is shown.source
    source, _ = opening._source(opening.ViewRequest(str(file), link="chest"))
    assert isinstance(source, Player)
    assert source.title == "x.mcap, chest"
    source.pause()
    unhurried(source)
    source.seek(0.1)
    shown = source.poll().zones
    wanted = [zones for t_s, _, zones in Recording(file).frames(link="chest") if t_s <= 0.1]
    assert shown.to_dict() == wanted[-1].to_dict()


def test_a_recording_with_the_table_alone_shows_a_link(tmp_path):
    record(tmp_path, about={"toml": "links = []"})
    source, _ = opening._source(opening.ViewRequest(str(tmp_path / "x.mcap")))
    assert source.title == "x.mcap, arm"


def test_an_arrow_ends_at_its_contact_and_shows_its_force(tmp_path):

    plan = Body.load(write_robot(tmp_path)).links["arm"]
    state = state_of(ROUND, 3, 5, 10.0)
    (contact,) = on_link(plan, state)
    assert pushes(plan, [contact]).shape == (0, 2, 3)
    object.__setattr__(contact, "force_n", (1.0, 0.5, -5.0))
    ((tail, tip),) = pushes(plan, [contact])
    np.testing.assert_allclose(plan.pose.apply(tip), contact.point_m)
    np.testing.assert_allclose(plan.pose.turn(tip - tail), 0.004 * np.array([1.0, 0.5, -5.0]))
