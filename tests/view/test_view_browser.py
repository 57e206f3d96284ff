"""The view in a real browser: a click on a cell becomes a zone on the screen, through gateware and driver."""

import pytest

pytest.importorskip("viser")
pytest.importorskip("playwright")
pytest.importorskip("amaranth")

from contactfpga.tools.view import opening
from contactfpga_sim.lab.view import browser, tables

pytestmark = [
    pytest.mark.campaign,  # the browser draws with the processor
    pytest.mark.skipif(browser.program() is None, reason="no Chromium is installed"),
]


@pytest.fixture(scope="module")
def seen():
    named = opening.ViewRequest("sim://?scene=nothing")
    with opening.opened(named, http_port=0) as shown, browser.visit(shown) as visitor:
        requests = []
        visitor.page.on("request", lambda request: requests.append(request.url))
        yield shown, visitor, requests


def test_a_click_becomes_a_zone_on_the_screen(seen):
    shown, visitor, requests = seen
    for click in tables.clicks(shown, visitor, 3):
        assert click.released <= click.touched <= click.read <= click.queued <= click.drawn
        assert 0 < click.gateware_s < 0.01
        assert sum(click.parts_s.values()) == pytest.approx(2 * click.parts_s["all"])
    assert [url for url in requests if not url.startswith(("data:", "blob:", shown.url.partition("?")[0]))] == []


def test_several_fingers_press_at_once_and_a_drag_moves_one(seen):
    shown, visitor, _ = seen
    shown.hand.lift()
    visitor.page.wait_for_timeout(1000)
    visitor.click(30, 30)
    visitor.page.wait_for_timeout(1000)
    visitor.click(120, 110)
    visitor.page.wait_for_timeout(1000)
    visitor.drag((75, 75), (80, 70), (100, 60), hold_ms=600)
    wanted = {(3, 3), (12, 11), (10, 6)}
    for _ in range(100):
        if (places := {(round(one.x_mm / 10), round(one.y_mm / 10)) for one in shown.hand.fingers}) == wanted:
            break
        visitor.page.wait_for_timeout(200)
    visitor.page.mouse.up()
    assert places == wanted


def test_the_token_does_not_stay_in_the_address(seen):
    shown, visitor, _ = seen
    assert shown.guard.token not in visitor.page.url
    assert shown.guard.token not in visitor.page.evaluate("document.cookie")
