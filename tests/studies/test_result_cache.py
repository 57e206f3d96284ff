"""The cache of results: its key covers every input."""

import pytest

from contactfpga_sim.apps import result_cache


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    monkeypatch.setenv("CONTACTFPGA_CACHE", str(tmp_path))
    return tmp_path


def test_a_result_is_worked_out_once_for_each_kind_and_key():
    calls = []

    def new():
        calls.append(1)
        return {"number": len(calls), "values": [1.5, None]}

    first = result_cache.cached("one", "key", new)
    assert result_cache.cached("one", "key", new) == first == {"number": 1, "values": [1.5, None]}
    assert result_cache.cached("one", "other key", new)["number"] == 2
    assert result_cache.cached("other", "key", new)["number"] == 3


def test_the_first_result_looks_like_a_later_one():
    assert result_cache.cached("one", "key", lambda: (1, 2)) == [1, 2]


def test_what_fails_is_not_kept(folder):
    with pytest.raises(ZeroDivisionError):
        result_cache.cached("one", "key", lambda: 1 // 0)
    assert result_cache.cached("one", "key", lambda: 2) == 2
    assert len(list(folder.glob("*.json"))) == 1
