"""A click in the page becomes a zone in the page, through the real gateware, the driver and the view."""

import struct

import pytest

pytest.importorskip("viser")
pytest.importorskip("websockets")
pytest.importorskip("amaranth")

from view_page import Page, camera, click, drag

import contactfpga
from contactfpga.tools.view import opening

CELLS, BARYCENTERS = "/sheet/cells", "/sheet/barycenters"


@pytest.fixture(scope="module")
def shown():
    from contactfpga_sim.lab.browser import running

    with opening.opened(opening.ViewRequest("sim://?scene=nothing"), http_port=0) as shown, running(shown):
        yield shown


@pytest.fixture
def page(shown):
    shown.hand.lift()
    with Page(shown.web.get_port(), shown.guard) as page:
        page.hear(lambda message: message["type"] == "ReplayDoneMessage")
        assert any(map(named(CELLS), page.heard))
        page.say(camera((0.075, 0.075, 1.0)))
        page.hear(lambda message: message["type"] == "SetCameraPositionMessage")
        yield page
    shown.hand.lift()


def named(name):
    return lambda message: message.get("name") == name


def floats(data):
    return struct.unpack(f"<{len(data) // 4}f", data)


def barycenter(page):
    """The next that is drawn."""
    return floats(page.hear(lambda message: named(BARYCENTERS)(message) and "props" in message)["props"]["points"])


def test_a_click_becomes_a_zone(shown, page):
    page.say(click(CELLS, (0.07, 0.03, 0.5), (0.0, 0.0, -1.0)))
    x, y, _ = barycenter(page)
    assert (x, y) == pytest.approx((0.07, 0.03), abs=1e-6)
    assert [(round(finger.x_mm), round(finger.y_mm)) for finger in shown.hand.fingers] == [(70, 30)]


def test_a_click_between_four_cells_presses_them(page):
    page.say(click(CELLS, (0.075, 0.035, 0.5), (0.0, 0.0, -1.0)))
    assert barycenter(page)[:2] == pytest.approx((0.075, 0.035), abs=1e-6)
    label = "75.0, 35.0 mm\n400 mm² "
    if not any(label in str(message.get("props", {}).get("text")) for message in page.heard):
        page.hear(lambda message: label in str(message.get("updates", message.get("props", {})).get("text")))


def test_a_second_click_lifts_the_finger(shown, page):
    page.say(click(CELLS, (0.07, 0.03, 0.5), (0.0, 0.0, -1.0)))
    barycenter(page)
    page.say(click(CELLS, (0.072, 0.031, 0.5), (0.0, 0.0, -1.0)))
    hidden = {"type": "SetSceneNodeVisibilityMessage", "name": BARYCENTERS, "visible": False}
    page.hear(lambda message: hidden.items() <= message.items())
    assert shown.hand.fingers == []


def test_a_drag_takes_a_finger_along(shown, page):
    places = [(0.02, 0.02, 0.0), (0.05, 0.02, 0.0), (0.09, 0.04, 0.0)]
    page.say(drag(CELLS, "start", places[0], places[0]))
    assert barycenter(page)[:2] == pytest.approx(places[0][:2], abs=1e-6)
    page.say(*(drag(CELLS, "update", places[0], place) for place in places[1:]))
    page.hear(lambda message: named(BARYCENTERS)(message) and near(message, places[2]))
    page.say(drag(CELLS, "end", places[0], places[2]))
    page.hear(lambda message: message.get("name") == BARYCENTERS and message.get("visible") is False)
    assert shown.hand.fingers == []


def near(message, place):
    points = message.get("props", {}).get("points")
    return points is not None and floats(points)[:2] == pytest.approx(place[:2], abs=1e-6)


def test_the_panel_says_how_it_goes(page):
    facts = str(page.hear(lambda message: "**latency**" in str(message)))
    assert "**lost** nothing" in facts
    assert "frames per second" in facts


def test_a_virtual_board_of_a_skin_is_no_robot():
    with pytest.raises(contactfpga.PortNotFound, match=r"/no/skin\.toml"):
        opening._source(opening.ViewRequest("sim://?skin=/no/skin.toml"))
