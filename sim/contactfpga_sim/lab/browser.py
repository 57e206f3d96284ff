"""The view in a headless browser, for tests."""

from __future__ import annotations

import contextlib
import shutil
import threading
import time
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from contactfpga.errors import MissingExtra, MissingTool
from contactfpga.tools.view.opening import ServedView, View
from contactfpga.tools.view.tiles import MM

NAMES = ("chromium", "chromium-browser", "google-chrome")
# Without a graphics card all is drawn by the processor.
SOFTWARE = ("--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader")
PATIENCE_S = 300.0

BOX = """
() => {
    const canvas = [...document.querySelectorAll('canvas')].sort((a, b) => b.width - a.width)[0];
    window.box = () => {
        const box = canvas.getBoundingClientRect();
        return [box.x, box.y, box.width, box.height];
    };
}
"""
"""``box()``: the canvas' left, top, width and height."""

OVER = "() => window.__viserMutable.canvas.style.cursor === 'pointer'"
"""Whether the page knows that the mouse is over something to be clicked."""


def program() -> str | None:
    """The installed browser, or None."""
    return next((found for name in NAMES if (found := shutil.which(name))), None)


class Visitor:
    def __init__(self, page: Any, shown: ServedView):
        self.page, self._shown = page, shown
        page.goto(shown.url)
        until = time.monotonic() + PATIENCE_S
        while not shown.web.get_clients():
            if time.monotonic() > until:
                raise TimeoutError("the page never said where its camera is")
            page.wait_for_timeout(50)
        page.evaluate(BOX)
        page.wait_for_selector("text=Software WebGL rendering detected", state="detached")  # it covers cells at first
        page.wait_for_timeout(500)

    def place(self, x_mm: float, y_mm: float, link: str = "") -> tuple[float, float]:
        """A place of the sheet as shares of the canvas; ``link``: of a robot."""
        view = self._shown.view
        stage = view.stage if isinstance(view, View) else view.stage.stages[link]
        point, _ = stage.tiles.surface.place(x_mm, y_mm)
        return self._seen(stage.rotation @ np.array(point) * MM + stage.point_m)

    def _seen(self, point_m: np.ndarray) -> tuple[float, float]:
        camera = next(iter(self._shown.web.get_clients().values())).camera
        x, y, z = turned(camera.wxyz, point_m - camera.position)
        scale = 0.5 / np.tan(camera.fov / 2) / z
        return 0.5 + x * scale / camera.aspect, 0.5 + y * scale

    def click(self, x_mm: float, y_mm: float, link: str = "") -> None:
        self._hover(lambda: self.place(x_mm, y_mm, link))
        self.page.mouse.down()
        self.page.mouse.up()

    def drag(self, *places: tuple[float, float], hold_ms: int = 300) -> None:
        """Drag from first to last place and hold; the button stays down."""
        shares = [self.place(*place) for place in places]
        self._hover(lambda: shares[0])
        self.page.mouse.down()
        for one in shares[1:]:
            self.page.mouse.move(*self._pixel(one), steps=8)
            self.page.wait_for_timeout(hold_ms)

    def _hover(self, place: Callable[[], tuple[float, float]]) -> None:
        """Move the mouse to a place until the page knows; it learns from moves alone, and draws later."""
        until = time.monotonic() + PATIENCE_S
        while True:
            left, top = self._pixel(place())
            self.page.mouse.move(left + 1, top)
            self.page.mouse.move(left, top)
            self.page.wait_for_timeout(100)
            if self.page.evaluate(OVER):
                return
            if time.monotonic() > until:
                raise TimeoutError("the page never knew that the mouse is over something to be clicked")

    def _pixel(self, shares: tuple[float, float]) -> tuple[float, float]:
        left, top, width, height = self.page.evaluate("window.box()")
        return left + shares[0] * width, top + shares[1] * height


def turned(wxyz: np.ndarray, vector: np.ndarray) -> np.ndarray:
    """A world vector in the camera's view: x right, y down, z ahead."""
    w, axis = wxyz[0], -np.asarray(wxyz[1:])
    found: np.ndarray = vector + 2 * np.cross(axis, np.cross(axis, vector) + w * vector)
    return found


@contextlib.contextmanager
def visit(shown: ServedView, width: int = 1100, height: int = 680) -> Iterator[Visitor]:
    """Open a view in a browser while a thread runs it."""
    try:
        from playwright.sync_api import sync_playwright
    except ModuleNotFoundError as error:
        raise MissingExtra(f"a browser ({error})", "test") from None
    path = program()
    if path is None:
        raise MissingTool("a picture of the view", NAMES[0], "sudo apt install chromium")
    with running(shown), sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=path, args=list(SOFTWARE), timeout=1e3 * PATIENCE_S)
        try:
            page = browser.new_page(viewport={"width": width, "height": height})
            page.set_default_timeout(1e3 * PATIENCE_S)
            yield Visitor(page, shown)
        finally:
            browser.close()


@contextlib.contextmanager
def running(shown: ServedView) -> Iterator[None]:
    ending = threading.Event()
    failed: list[BaseException] = []

    def run() -> None:
        try:
            while not ending.is_set():
                shown.view.step()
        except BaseException as error:  # raised where it is waited for
            failed.append(error)

    thread = threading.Thread(target=run, name="view", daemon=True)
    thread.start()
    try:
        yield
    finally:
        ending.set()
        thread.join()
    if failed:
        raise failed[0]
