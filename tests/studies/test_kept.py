"""Results that are kept by what they were made of."""

import pytest

from contactfpga_sim.studies import kept


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    monkeypatch.setenv("CONTACTFPGA_CACHE", str(tmp_path))
    return tmp_path


def test_a_result_is_worked_out_once_for_each_kind_and_key():
    calls = []

    def new():
        calls.append(1)
        return {"number": len(calls), "values": [1.5, None]}

    first = kept.kept("one", "key", new)
    assert kept.kept("one", "key", new) == first == {"number": 1, "values": [1.5, None]}
    assert kept.kept("one", "other key", new)["number"] == 2
    assert kept.kept("other", "key", new)["number"] == 3


def test_the_first_result_looks_like_a_later_one():
    assert kept.kept("one", "key", lambda: (1, 2)) == [1, 2]


def test_what_fails_is_not_kept(folder):
    with pytest.raises(ZeroDivisionError):
        kept.kept("one", "key", lambda: 1 // 0)
    assert kept.kept("one", "key", lambda: 2) == 2
    assert len(list(folder.iterdir())) == 1


def test_other_code_has_another_digest(monkeypatch, tmp_path):
    before = kept.sources()
    package = tmp_path / "package"
    package.mkdir()
    (package / "__init__.py").write_text("")
    stand_in = type("Package", (), {"__file__": str(package / "__init__.py")})
    monkeypatch.setattr(kept, "_PACKAGES", (stand_in,))
    kept._own.cache_clear()
    empty = kept.sources()
    (package / "new.py").write_text("x = 1")
    kept._own.cache_clear()
    assert len({before, empty, kept.sources()}) == 3
    kept._own.cache_clear()
