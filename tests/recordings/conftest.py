"""What the tests of recordings share."""

import pytest

from contactfpga.tools.recordings import link_recorder, recorder


@pytest.fixture(autouse=True)
def _patience(monkeypatch):
    """On a busy machine as well, what waits at the end of a recording has time to become messages, and a new file waits
    for its hello."""
    monkeypatch.setattr(link_recorder, "END_S", 60.0)
    monkeypatch.setattr(recorder, "PATIENCE_S", 60.0)
