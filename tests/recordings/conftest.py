"""What the tests of recordings share."""

import pytest

from contactfpga.tools.recordings import link_recorder


@pytest.fixture(autouse=True)
def _patience(monkeypatch):
    """What waits at the end of a recording has time to become messages, on a busy machine as well."""
    monkeypatch.setattr(link_recorder, "END_S", 60.0)
