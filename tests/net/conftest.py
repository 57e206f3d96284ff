"""What the tests of boards in the network share."""

import pytest
from net_processes import free_endpoint, wait_long


@pytest.fixture
def endpoint():
    """Where nobody listens."""
    return free_endpoint()


@pytest.fixture(autouse=True)
def _patience(monkeypatch):
    """A test of who is not there sets its own limits."""
    wait_long(monkeypatch)
