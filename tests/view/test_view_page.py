"""The view's page in a real browser: it fills windows of any size and fits again, in light and dark, without the
library's marks, and keeps a picture."""

import struct

import numpy as np
import pytest

pytest.importorskip("viser")
pytest.importorskip("playwright")
pytest.importorskip("amaranth")

from contactfpga.tools.view import opening
from contactfpga_sim.lab import browser

pytestmark = [
    pytest.mark.slow,  # about a minute and a half: the browser draws with the processor
    pytest.mark.skipif(browser.program() is None, reason="no Chromium is installed"),
]


@pytest.fixture(scope="module")
def seen():
    # The window is small because the processor draws it.
    with opening.opened(http_port=0) as shown, browser.visit(shown, 800, 500) as visitor:
        yield shown, visitor


def extent(shown, visitor):
    """Shares of the canvas that the forearm takes, from its own points."""
    points = shown.view.stage.points_m
    camera = next(iter(shown.web.get_clients().values())).camera
    x, y, z = np.array([browser.turned(camera.wxyz, point - camera.position) for point in points]).T
    scale = 0.5 / np.tan(camera.fov / 2) / z
    return (0.5 + x * scale / camera.aspect), (0.5 + y * scale)


def fitted(shown, visitor, apart_from=()):
    """The same, and the camera's position, once the forearm fills the canvas from elsewhere than from those places."""
    for _ in range(600):
        place = next(iter(shown.web.get_clients().values())).camera.position
        x, y = extent(shown, visitor)
        fills = max(np.ptp(x), np.ptp(y)) == pytest.approx(1 / 1.04, abs=0.02)
        if fills and all(np.linalg.norm(place - other) > 0.1 for other in apart_from):
            break
        visitor.page.wait_for_timeout(200)
    else:
        pytest.fail(f"it takes {np.ptp(x):.3f} of the width and {np.ptp(y):.3f} of the height from {place}")
    return x, y, place


def resized(shown, visitor, width, height):
    """The canvas' left, top, width and height once it has settled, and the server knows of it."""
    visitor.page.set_viewport_size({"width": width, "height": height})
    wanted = (width - 334, height) if width > 500 else (width, 0.54 * height)
    for _ in range(600):
        left, top, wide, high = visitor.page.evaluate("window.box()")
        aspect = next(iter(shown.web.get_clients().values())).camera.aspect
        if (wide, high) == pytest.approx(wanted, abs=12) and aspect == pytest.approx(wide / high, abs=0.02):
            break
        visitor.page.wait_for_timeout(200)
    visitor.page.wait_for_timeout(1500)
    return left, top, wide, high


def arrow(page):
    """Whether viser's arrow of a drag is there, and whether any of it is drawn."""
    return page.evaluate(
        """() => {
            const found = window.__viserMutable.scene.children.find((one) => one.line && one.cone);
            return [found.visible, found.line.visible || found.cone.visible];
        }"""
    )


def test_a_drag_presses_and_no_arrow_covers_the_sheet(seen):
    shown, visitor = seen
    sheet = shown.view.stage.tiles.sheet
    visitor.drag(*((2 * sheet.pitch_x_mm, row * sheet.pitch_y_mm) for row in (4, 7, 9)), hold_ms=1000)
    for _ in range(1200):
        if shown.hand.fingers and abs(shown.hand.fingers[0].y_mm - 90) < 2:
            break
        visitor.page.wait_for_timeout(100)
    (finger,) = shown.hand.fingers
    assert (finger.x_mm, finger.y_mm) == pytest.approx((2 * sheet.pitch_x_mm, 90), abs=3)
    assert arrow(visitor.page) == [True, False]
    visitor.page.mouse.up()
    assert shown.guard.token not in visitor.page.url + visitor.page.evaluate("document.cookie")


def test_a_picture_has_the_time_and_the_contacts_under_it(seen, tmp_path):
    """Its height tells the lines of text: 1.6 times 14 pixels each, and one more."""
    shown, visitor = seen
    shown.hand.click(30, 50)
    shown.hand.click(30, 110)
    visitor.page.wait_for_selector("text=2 contacts")
    _, _, shown_wide, shown_high = visitor.page.evaluate("window.box()")
    with visitor.page.expect_download() as kept:
        visitor.page.keyboard.press("p")
    kept.value.save_as(tmp_path / "kept.png")
    assert kept.value.suggested_filename == "contactfpga.png"
    wide, high = struct.unpack(">II", (tmp_path / "kept.png").read_bytes()[16:24])
    scale = wide / shown_wide  # a slow computer draws fewer pixels
    assert high == pytest.approx(scale * (shown_high + 4 * 1.6 * 14), abs=2)
    assert 0.25 < scale < 1.01
    visitor.page.keyboard.press("l")
    visitor.page.wait_for_selector("text=Nothing touches")
    assert shown.hand.fingers == []


def test_keys_put_a_finger_down_and_move_it(seen):
    shown, visitor = seen
    sheet = shown.view.stage.tiles.sheet
    keys = [*"lf", "Shift+ArrowRight", "Shift+ArrowDown", "Shift+ArrowDown", "Shift+ArrowUp"]
    for key in keys:
        visitor.page.keyboard.press(key)
    visitor.page.wait_for_selector("text=1 contact")
    (finger,) = shown.hand.fingers
    assert finger.x_mm == (sheet.columns // 2 + 1) * sheet.pitch_x_mm
    assert finger.y_mm == (sheet.rows // 2 + 1) * sheet.pitch_y_mm
    visitor.page.keyboard.press("l")
    visitor.page.wait_for_selector("text=Nothing touches")


def test_keys_and_buttons_turn_the_view_and_it_is_fitted(seen):
    shown, visitor = seen
    places = [fitted(shown, visitor)[2]]
    for key in "234":
        visitor.page.keyboard.press(key)
        places.append(fitted(shown, visitor, places)[2])
    visitor.page.locator("button:has-text('overview')").click()
    fitted(shown, visitor, places[1:])


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_a_page_is_dark_for_who_likes_it(seen, scheme):
    """Its tab has the project's name, and the library's notice of slow drawing leaves the sheet."""
    shown, visitor = seen
    page = visitor.page.context.browser.new_page(viewport={"width": 400, "height": 300}, color_scheme=scheme)
    page.set_default_timeout(1e3 * browser.PATIENCE_S)
    try:
        page.goto(shown.url)
        page.wait_for_selector(f"html[data-mantine-color-scheme={scheme}]", state="attached")
        red, green, blue = page.evaluate("getComputedStyle(document.body).backgroundColor.match(/[0-9]+/g).map(Number)")
        assert (red + green + blue < 150) == (scheme == "dark")
        page.wait_for_function("document.title == 'contactfpga'")
        page.wait_for_selector("text=Software WebGL rendering detected", state="detached")
    finally:
        page.close()


@pytest.mark.parametrize(("width", "height"), [(1920, 1080), (390, 844)])
def test_the_forearm_fills_the_window_beside_or_above_the_panel(seen, width, height):
    shown, visitor = seen
    left, top, wide, high = resized(shown, visitor, width, height)
    panel = visitor.page.locator("text=contactfpga").first.bounding_box()
    assert (left, top) == (0, 0)
    if width > 500:
        assert wide == pytest.approx(width - 334, abs=4)
        assert high == height
        assert panel["x"] >= wide
    else:
        assert wide == width
        assert 0.5 * height < high < 0.6 * height
        assert panel["y"] >= high
    x, y, _ = fitted(shown, visitor)
    assert min(x.min(), y.min()) >= 0
    assert max(x.max(), y.max()) <= 1
