"""The closing force of switches from measured ones: intervals against forces that are drawn."""

import numpy as np
import pytest

from contactfpga.design.cover import CoverError, fitted
from contactfpga.design.cover.fitted import fit_force


@pytest.mark.parametrize("count", [3, 9])
def test_the_interval_covers_the_truth_as_often_as_it_says(count, monkeypatch):
    monkeypatch.setattr(fitted, "DRAWS", 20_000)
    covered = 0
    for seed in range(400):
        rng = np.random.default_rng(seed)
        truth, predicted = rng.uniform(0.2, 1.0), rng.uniform(0.5, 1.5, count)
        pairs = [(one, one * truth / 0.4 * np.exp(rng.normal(0, 0.1))) for one in predicted]
        found = fit_force(0.4, pairs)
        covered += found.low <= truth <= found.high
    assert 0.93 <= covered / 400 <= 0.97


def test_forces_that_tell_nothing_are_refused():
    with pytest.raises(CoverError, match="2 closing forces were measured; 3 are needed"):
        fit_force(0.4, [(1.0, 1.1)] * 2)
    with pytest.raises(CoverError, match="a closing force is not above 0 N"):
        fit_force(0.4, [(1.0, 1.1), (1.0, 0.0), (1.0, 1.0)])
