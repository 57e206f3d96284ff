"""Changes of the gateware's source that `make mutants-tested` plants, and which tests it runs for each."""

import json

import pytest
import tested_mutants
from tested_mutants import Change, Noted

SOURCE = """
def build(m, a, b, c, wide):
    \"\"\"Does nothing that is 1 & 2.\"\"\"
    if wide & 4:
        m.d.comb += c.eq(a & ~b if wide else Mux(a, b, 3))
    with m.If((a == b) | b.any()):
        m.d.sync += [a.eq(b + 1), b.eq(a[2])]
"""


@pytest.fixture
def changed(tmp_path, monkeypatch):
    """{old text: {new texts}} of all changes of the source."""
    monkeypatch.setattr(tested_mutants, "GATEWARE", tmp_path)
    (tmp_path / "one.py").write_text(SOURCE)
    found: dict[str, set[str]] = {}
    for change in tested_mutants.changes_of("one.py"):
        assert change.function == "build"
        assert change.applied(SOURCE).count(change.new) >= 1
        assert compile(change.applied(SOURCE), "one.py", "exec")
        found.setdefault(change.old, set()).add(change.new)
    return found


def test_assignments_and_conditions_are_changed_in_each_place_and_nothing_else(changed):
    assert changed == {
        "c.eq(a & ~b if wide else Mux(a, b, 3))": {"()"},
        "a & ~b": {"((a) | (~b))", "(a)", "(~b)"},
        "~b": {"(b)"},
        "Mux(a, b, 3)": {"Mux(a, 3, b)"},
        "3": {"4"},
        "(a == b) | b.any()": {"~((a == b) | b.any())", "((a == b) & (b.any()))", "(a == b)", "(b.any())"},
        "a == b": {"((a) != (b))"},
        "b.any()": {"(b).all()"},
        "a.eq(b + 1)": {"*()"},
        "b + 1": {"((b) - (1))"},
        "1": {"2"},
        "b.eq(a[2])": {"*()"},
    }


def test_each_change_of_the_gateware_can_be_compiled():
    changes = tested_mutants.drawn(100, 1)
    assert len(set(changes)) == 100
    for change in changes:
        source = (tested_mutants.GATEWARE / change.file).read_text()
        assert source[change.begin : change.end] == change.old
        assert compile(change.applied(source), change.file, "exec")


def test_copies_note_the_functions_that_are_run():
    sources = tested_mutants.noting()
    text = sources["link/alive.py"]
    assert "_note('link/alive.py:Alive.elaborate')" in text
    places = {(change.file, change.function) for change in tested_mutants.drawn(100, 2)}
    assert all(f"_note('{file}:{function}')" in sources[file] for file, function in places)


def test_the_cheapest_tests_that_run_a_function_come_first_and_each_proof_stands_alone(tmp_path):
    proof, other = (f"{tested_mutants.PROOFS}::test_the_claim_holds[{name}]" for name in ("one", "other"))
    ran = [("a.py::x", 5, "f"), ("a.py::y", 3, "g"), ("b.py::x", 1, "f"), ("c.py::x", 90, "f"), ("d.py::x", 1, "g")]
    for test, seconds, touched in [*ran, (proof, 2, "f"), (other, 2, "g")]:
        with (tmp_path / "1.jsonl").open("a") as file:
            file.write(json.dumps({"test": test, "seconds": seconds, "touched": [touched]}) + "\n")
    assert list(Noted(tmp_path).batches("f")) == [["b.py", proof, "a.py"], ["c.py"]]
    assert list(Noted(tmp_path).batches("h")) == []


def test_tables_count_by_folder_and_tell_why_a_change_is_not_noticed(monkeypatch):
    changes = [Change(file, "f", 1, 0, 1, "a | b", "(a)") for file in ("scan/a.py", "scan/b.py", "link/a.py", "top.py")]
    found = list(zip(changes, ["killed", "alive", "alive", "killed"]))
    monkeypatch.setattr(tested_mutants, "EXPLAINED", {("link/a.py", "a | b -> (a)"): ("equivalent", "b is 0")})
    lines = tested_mutants.table(found).splitlines()
    assert lines[2:] == [
        "| link | 1 | 0 | 1 | 0 |  |",
        "| scan | 2 | 1 | 0 | 1 | 50.0 % |",
        "| top.py | 1 | 1 | 0 | 0 | 100.0 % |",
        "| all | 4 | 2 | 1 | 1 | 66.7 % |",
    ]
    assert tested_mutants.left(found).splitlines()[2:] == [
        "| `scan/b.py`, `f` | `a \\| b -> (a)` | alive | not known |",
        "| `link/a.py`, `f` | `a \\| b -> (a)` | equivalent | b is 0 |",
    ]
