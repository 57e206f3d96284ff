"""A browser for the tests of pages."""

import pytest


@pytest.fixture(scope="module")
def chromium():
    """Headless Chromium without a network."""
    from playwright.sync_api import sync_playwright

    from contactfpga_sim.lab import browser

    switches = ["--no-sandbox", "--disable-gpu", "--disable-quic", "--disable-background-networking"]
    with sync_playwright() as playwright:
        program = playwright.chromium.launch(executable_path=browser.program(), args=switches, timeout=120_000)
        yield program
        program.close()
