"""Fixtures that tests of the gateware share."""

import pytest


@pytest.fixture(scope="module")
def benches():
    """Compiled labellers: ``benches(rows, columns, connectivity, labeller, closed, extent)``."""
    from zone_oracles import skin_of

    from contactfpga_sim.verify.cosim.bench_labeller import LabelBench

    built = {}

    def bench(*facts):
        skin = skin_of(*facts)
        if skin not in built:
            built[skin] = LabelBench(skin)
        return built[skin]

    yield bench
    for one in built.values():
        one.close()


@pytest.fixture
def soon(monkeypatch):
    """Line reversal checks a sheet at rest every 32 us, and renews what is reported every 256 us."""
    from reversal import checked_soon

    checked_soon(monkeypatch)
