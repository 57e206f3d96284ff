"""What the tests of `contactfpga fit` share: scenes, and formulas in the place of synthesis."""

from concurrent.futures import ThreadPoolExecutor

import pytest
from fits import Shortcuts

from contactfpga_sim.apps import pool, result_cache, speed
from contactfpga_sim.apps.fit import cost


@pytest.fixture
def alone(tmp_path, monkeypatch):
    """Results of this test only, in threads of this process."""
    monkeypatch.setattr(result_cache, "cache_folder", lambda: tmp_path / "kept")
    monkeypatch.setattr(pool, "executor", lambda jobs, dask: ThreadPoolExecutor(1))


@pytest.fixture
def shortcuts(monkeypatch):
    """Sizes and times by formulas: seconds in the place of minutes. Some tests take the real ones."""
    used = Shortcuts()
    monkeypatch.setattr(cost, "luts_of", used.luts_of)
    monkeypatch.setattr(speed, "measure", used.measure)
    return used


@pytest.fixture
def file(tmp_path):
    def file(text, name="scenes.toml"):
        (tmp_path / name).write_text(text)
        return str(tmp_path / name)

    return file
