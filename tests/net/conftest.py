"""What the tests of boards in the network share."""

import pytest
from net_processes import LONG_S, free_endpoint

from contactfpga.robot.net import port, session


@pytest.fixture
def endpoint():
    """Where nobody listens."""
    return free_endpoint()


@pytest.fixture(autouse=True)
def _patience(monkeypatch):
    """Who is there is found, connected and kept, however late; a test of who is not sets its own limits."""
    monkeypatch.setattr(port, "FOUND_S", LONG_S)
    monkeypatch.setattr(session, "CONNECT_MS", round(1000 * LONG_S))
    monkeypatch.setattr(session, "LEASE_MS", round(1000 * LONG_S))
