"""Fixtures that tests of the view share."""

import time
from types import SimpleNamespace

import pytest


@pytest.fixture
def clock(monkeypatch):
    """A clock for a player, which only its sleep moves on."""
    from contactfpga.tools.view import playback

    now = [10.0]
    sleep = lambda seconds: now.__setitem__(0, now[0] + seconds)  # noqa: E731
    # In its place alone: other threads of this process sleep as well.
    monkeypatch.setattr(playback, "time", SimpleNamespace(sleep=sleep, monotonic=time.monotonic))
    return lambda: now[0]
