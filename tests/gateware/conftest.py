"""Fixtures that tests of the gateware share."""

import pytest


@pytest.fixture(scope="module")
def benches():
    """Compiled labellers: ``benches(rows, columns, connectivity, labeller)``."""
    from contactfpga.skin import Skin
    from contactfpga_sim.verify.cosim.bench_labeller import LabelBench

    built = {}

    def bench(rows, columns, connectivity, labeller):
        skin = Skin(rows=rows, columns=columns, connectivity=connectivity, labeller=labeller, settle_us=20.0)
        if skin not in built:
            built[skin] = LabelBench(skin)
        return built[skin]

    yield bench
    for one in built.values():
        one.close()


@pytest.fixture
def soon(monkeypatch):
    """Line reversal checks a sheet at rest every 32 us, and renews what is told every 256 us."""
    from reversal import checked_soon

    checked_soon(monkeypatch)
