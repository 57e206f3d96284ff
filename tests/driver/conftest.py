"""Tests of a board on a pseudo-terminal run with either reader; see :func:`contactfpga.open`."""

import pytest

from contactfpga.driver import driver, native
from contactfpga.driver.requests import Requests

WITH_EITHER = ("test_driver", "test_driver_frames", "test_recording")


def pytest_generate_tests(metafunc: pytest.Metafunc) -> None:
    if metafunc.module.__name__.rpartition(".")[2] in WITH_EITHER and "board" in metafunc.fixturenames:
        metafunc.fixturenames.append("default_reader")
        readers = [
            "native" if not native.missing() else pytest.param("native", marks=pytest.mark.skip(native.missing()))
        ]
        readers.append(pytest.param("thread", marks=pytest.mark.slow))
        metafunc.parametrize("default_reader", readers, indirect=True)


@pytest.fixture
def _asks_once(monkeypatch):
    """A board that has to wait answers late, and not twice, as where it is asked again: its frames are counted."""
    monkeypatch.setattr(Requests, "retry_s", property(lambda self: 60.0, lambda self, seconds: None), raising=False)


@pytest.fixture
def default_reader(request, monkeypatch):
    """Who reads where a test does not say it."""
    monkeypatch.setitem(driver.open.__kwdefaults__, "reader", request.param)
    return request.param
