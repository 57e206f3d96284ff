"""Fixtures that tests of the view share."""

import pytest


@pytest.fixture
def clock(monkeypatch):
    """A clock for a player, which only its sleep moves on."""
    from contactfpga.tools.view import playback

    now = [10.0]
    monkeypatch.setattr(playback.time, "sleep", lambda seconds: now.__setitem__(0, now[0] + seconds))
    return lambda: now[0]
