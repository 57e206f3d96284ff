"""The page in a real browser, opened from a file: what it shows is what the same board and cover say in Python."""

import re

import numpy as np
import pytest
from try_page import assemble, load

pytest.importorskip("viser")
pytest.importorskip("playwright")

from playwright.sync_api import expect
from scipy import ndimage

from contactfpga.design import kits
from contactfpga.design.cover import cells_of, load_cover
from contactfpga_sim.lab import browser

pytestmark = [
    pytest.mark.slow,  # 30 to 60 s
    pytest.mark.skipif(browser.program() is None, reason="no Chromium is installed"),
]

KIT = kits.kit(assemble.KIT)
PITCH_MM = KIT.skin.pitch_x_mm
PATIENCE_MS = 60_000
MOST_BYTES = 200_000
READY_S = 0.5
"""Of the processor until the page is ready: on a machine with nothing else to do, that is when."""

expect.set_options(timeout=PATIENCE_MS)


@pytest.fixture(scope="module")
def file(tmp_path_factory):
    file = tmp_path_factory.mktemp("try") / "try.html"
    file.write_text(assemble.page(), encoding="utf-8")
    return file


@pytest.fixture
def visit(file, chromium):
    """Opens the page: ``visit(width, color_scheme=...)``. Nothing may go wrong in it, and it asks for nothing."""
    contexts, wrong, requests = [], [], []

    def visit(width=1400, height=900, **options):
        context = chromium.new_context(viewport={"width": width, "height": height}, **options)
        contexts.append(context)
        page = context.new_page()
        page.set_default_timeout(PATIENCE_MS)
        page.on("request", lambda request: requests.append(request.url))
        page.on("pageerror", lambda error: wrong.append(str(error)))
        page.on("console", lambda message: wrong.append(message.text))
        page.goto(file.as_uri())
        page.wait_for_selector("html[data-ready]")
        return page

    yield visit
    for context in contexts:
        context.close()
    assert wrong == []
    assert set(requests) == {file.as_uri()}
    assert len(requests) == len(contexts)


def pixel(page, x_mm, y_mm):
    """Where a place of the sheet is in the window."""
    page.locator("#sheet").scroll_into_view_if_needed()
    box = page.locator("#sheet").bounding_box()
    left, top, width, _ = map(float, page.get_attribute("#sheet", "viewBox").split())
    return box["x"] + (x_mm - left) * box["width"] / width, box["y"] + (y_mm - top) * box["width"] / width


def press(page, x_mm, y_mm):
    page.mouse.move(*pixel(page, x_mm, y_mm))
    page.mouse.down()
    page.mouse.up()


def fingers_of(page):
    """x, y, force and radius in mm and N of the fingers that are on the page."""
    fingers = page.locator(".fingers > g").all()
    said = [(one.get_attribute("aria-label"), one.locator(".skin").get_attribute("r")) for one in fingers]
    return [(*map(float, re.findall(r"-?[\d.]+", label)), float(radius)) for label, radius in said]


def closed_on(page):
    """(rows, columns) bool: the switches that the page draws as closed. They are all that its fingers close, and none
    but those that they can hold: a dome that is closed opens at less force."""
    closed = cells_named(page, "closed")
    cover, pitch_m = load_cover(KIT.skin_path), PITCH_MM * 1e-3
    cells = cells_of(cover, *closed.shape, pitch_m, pitch_m)
    fingers = fingers_of(page)
    loads = [
        load(cells, {"x_mm": x, "y_mm": y, "force_n": force, "radius_mm": radius}) for x, y, force, radius in fingers
    ]
    assert not (cells.closed(loads) & ~closed).any()
    assert not (closed & ~cells.closed(loads, np.ones_like(closed))).any()
    return closed


def cells_named(page, name):
    names = page.locator(".caps rect").evaluate_all(
        "(all, name) => all.map((one) => one.classList.contains(name))", name
    )
    return np.reshape(names, (KIT.skin.rows, KIT.skin.columns))


def zones_of(page):
    rows = page.locator("#zones tbody tr").all_inner_texts()
    return sorted(tuple(map(float, row.split("\t")[1:4])) for row in rows)


def lifted(page):
    page.keyboard.press("Escape")
    expect(page.locator("#headline")).to_have_text("Nothing touches it")


def same(page, count, dead=np.s_[:0]):
    """The page shows the zones of its closed switches, without ``dead`` ones; there are ``count`` zones."""
    expect(page.locator("#zones tbody tr")).to_have_count(count)
    for _ in range(PATIENCE_MS // 300):  # after some scans, however slow the browser is
        page.wait_for_timeout(300)
        closed = closed_on(page)
        closed[dead] = False
        if (cells_named(page, "read") == closed).all():
            break
    else:
        pytest.fail("the page shows other cells than those that are pressed")
    assert page.locator(".outlines path").count() == page.locator(".marks circle").count() == count
    labels, found = ndimage.label(closed)
    assert found == count
    zones = [np.argwhere(labels == 1 + number) for number in range(count)]
    wanted = sorted((len(zone) * PITCH_MM**2, *(zone.mean(axis=0)[::-1] * PITCH_MM)) for zone in zones)
    for shown, zone in zip(zones_of(page), wanted, strict=True):
        assert shown == pytest.approx(zone, abs=0.51)  # rounded to whole mm2
        assert shown[1:] == pytest.approx(zone[1:], abs=0.051)


def test_it_is_small_and_soon_ready(file, chromium, record_property):
    assert file.stat().st_size <= MOST_BYTES
    page = chromium.new_page()
    page.set_default_timeout(PATIENCE_MS)
    session = page.context.new_cdp_session(page)
    session.send("Performance.enable", {"timeDomain": "threadTicks"})
    page.goto(file.as_uri())
    page.wait_for_selector("html[data-ready]")
    metrics = {each["name"]: each["value"] for each in session.send("Performance.getMetrics")["metrics"]}
    record_property("ready_ms", page.evaluate("performance.getEntriesByName('ready')[0].startTime"))
    page.close()
    assert 0 < metrics["ThreadTime"] <= 4 * READY_S  # beside other work a second costs more; 0.2 to 0.7 s were seen


def test_its_policy_forbids_the_network(file, chromium):
    assert not re.search(r"""(src|href)=["'](?!#)""", file.read_text())
    page = chromium.new_page()
    page.goto(file.as_uri())
    assert page.evaluate("fetch('data:,x').then(() => 'loaded', () => 'stopped')") == "stopped"
    page.close()


def test_fingers_of_the_mouse_make_the_zones_of_python(visit):
    page = visit()
    lifted(page)
    press(page, 20.3, 31.1)
    same(page, 1)
    assert 0 < float(page.inner_text("#to-pin").split()[0]) < 47
    assert page.input_value("#cursor") == page.get_attribute("#cursor", "max")
    page.locator("#force").fill("8")
    page.locator("#size").fill("26")
    same(page, 1)
    press(page, 70.2, 80.9)
    same(page, 2)
    press(page, 70.2, 80.9)
    expect(page.locator("#headline")).to_have_text("One contact")


def test_a_drag_moves_a_finger_and_a_light_one_is_not_felt(visit):
    page = visit()
    lifted(page)
    page.mouse.move(*pixel(page, 20, 20))
    page.mouse.down()
    page.mouse.move(*pixel(page, 50, 60), steps=5)
    page.mouse.up()
    assert fingers_of(page)[0][:2] == pytest.approx((50, 60), abs=0.3)
    same(page, 1)
    page.mouse.down()  # the same one again
    page.mouse.move(*pixel(page, 30, 25), steps=5)
    page.mouse.up()
    assert [finger[:2] for finger in fingers_of(page)] == [pytest.approx((30, 25), abs=0.3)]
    same(page, 1)
    page.locator("#force").fill("0.3")
    expect(page.locator("#headline")).to_have_text("Nothing touches it")


def test_two_fingers_touch_at_once_and_leave(visit):
    page = visit(390, 844, has_touch=True)
    lifted(page)
    page.locator("#keep").uncheck()
    touch = page.context.new_cdp_session(page)
    places = [pixel(page, 20, 20), pixel(page, 70, 50)]
    points = [{"x": x, "y": y, "id": number} for number, (x, y) in enumerate(places)]
    touch.send("Input.dispatchTouchEvent", {"type": "touchStart", "touchPoints": points})
    same(page, 2)
    touch.send("Input.dispatchTouchEvent", {"type": "touchEnd", "touchPoints": []})
    expect(page.locator("#headline")).to_have_text("Nothing touches it")


def test_keys_put_move_resize_and_lift_a_finger(visit):
    page = visit()
    lifted(page)
    page.keyboard.press("Tab")
    assert page.evaluate("document.activeElement.id") == "sheet"
    page.keyboard.press("Enter")
    same(page, 1)
    middle = 7.5 * PITCH_MM
    page.keyboard.press("ArrowLeft")
    page.keyboard.press("Shift+ArrowDown")
    assert fingers_of(page)[0][:2] == pytest.approx((middle - 1, middle + PITCH_MM), abs=0.051)
    page.keyboard.press("+")
    page.keyboard.press("]")
    assert fingers_of(page)[0][2:] == pytest.approx((4.5, 8.75))
    same(page, 1)
    page.keyboard.press("Delete")
    expect(page.locator("#headline")).to_have_text("Nothing touches it")


def test_broken_lines_and_a_stuck_column_are_reported_and_a_jammed_switch_is_not(visit):
    page = visit()
    lifted(page)
    report, fault = page.locator("#report"), page.locator("#faults button")
    expect(report).to_have_text("The board reports: all lines are whole.")
    press(page, 9 * PITCH_MM, 5 * PITCH_MM)
    page.locator("#size").fill("28")
    page.locator("#force").fill("10")
    same(page, 1)
    fault.nth(0).click()
    expect(report).to_contain_text("The board reports: row 5 is open before its far end.")
    expect(page.locator("#contact")).to_contain_text("high")
    expect(page.locator("#alive")).to_contain_text("stopped")
    same(page, 1, dead=np.s_[5, 9:])
    page.locator("text=Mend the row").click()
    expect(fault.nth(0)).to_have_text("Cut the row")
    expect(report).to_have_text("The board reports: all lines are whole.")
    fault.nth(2).click()
    expect(report).to_contain_text("column 9 reads pressed while no row is driven")
    fault.nth(2).click()
    expect(report).to_have_text("The board reports: all lines are whole.")
    page.keyboard.press("Escape")
    fault.nth(3).click()
    expect(page.locator("#headline")).to_have_text("One contact")
    assert zones_of(page) == [(41.0, 57.6, 32.0)]
    assert "row" not in report.inner_text()


def test_slow_motion_stops_at_rows_zones_and_bytes(visit):
    page = visit()
    moments = stopped_at(page)
    said = "\n".join(moments.values())
    for what in (
        r"Row \d+ is driven",
        r"Row 6 is read: columns? \d",
        "A zone is complete",
        "tell the touch",
        "contact rises",
    ):
        assert re.search(what, said), what
    telling = re.search(r"(\d+) of \1 that tell the touch", said)
    assert page.locator(".received .hit").count() == int(telling[1]) == 17
    assert page.locator(".records .hit").count() >= 1 <= page.locator(".records .end").count()
    assert page.locator(".rows .hit").count() >= len(set(re.findall(r"Row (\d+) is read: column", said))) >= 2
    assert not cells_named(page, "read").any()
    page.locator("#live").click()
    page.wait_for_selector(".caps .read")
    same(page, 1)


def stopped_at(page):
    """What the page says at each stop of slow motion, by the slider's value, from the last byte back to the touch."""
    found = {}
    while "The switches close." not in found.get("0", ""):
        page.locator("#back").click()
        found[page.input_value("#cursor")] = page.inner_text("#moment")
    return found


@pytest.mark.parametrize("color_scheme", ["light", "dark"])
def test_it_fits_a_phone_and_a_desk(visit, color_scheme):
    for width in (390, 1400):
        page = visit(width, color_scheme=color_scheme)
        assert page.evaluate("document.documentElement.scrollWidth") <= width
        ground, ink = (brightness(page, name) for name in ("backgroundColor", "color"))
        assert (ink - ground > 150) if color_scheme == "dark" else (ground - ink > 150)


def brightness(page, name):
    color = page.evaluate("(name) => getComputedStyle(document.body)[name]", name)
    return np.mean([int(part) for part in re.findall(r"\d+", color)])
