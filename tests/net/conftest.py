"""What the tests of boards in the network share."""

import pytest
from net_processes import free_endpoint


@pytest.fixture
def endpoint():
    """Where nobody listens."""
    return free_endpoint()
