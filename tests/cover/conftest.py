"""What the tests of `contactfpga cover` share."""

import functools

import pytest


@pytest.fixture
def run(run):
    """Runs `contactfpga cover`; returns status, output and errors."""
    return functools.partial(run, "cover")
