"""`contactfpga wave`: its files are read back by another library, and hold what the sheet and the line did."""

import bisect
import contextlib
import dataclasses
import io
import json
import re

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from vcd import VCDWriter
from vcd.reader import TokenKind, tokenize

from contactfpga.driver.conversation import Conversation, frames_in
from contactfpga.skin import Skin
from contactfpga.wire import protocol
from contactfpga_sim.model import golden
from contactfpga_sim.verify import wave

SMALL = Skin(rows=4, columns=5, clock_hz=3_000_000, baud=750_000, settle_us=5.0, mask=((0, 0),))


def read_back(data: bytes) -> dict[str, list[tuple[int, int]]]:
    """(time, value) of each change, by the path of the signal."""
    path, names, found, now = [], {}, {}, 0
    for token in tokenize(io.BytesIO(data)):
        if token.kind is TokenKind.SCOPE:
            path.append(token.data.ident)
        elif token.kind is TokenKind.UPSCOPE:
            path.pop()
        elif token.kind is TokenKind.VAR:
            names.setdefault(token.data.id_code, []).append(".".join([*path, token.data.reference]))
        elif token.kind is TokenKind.CHANGE_TIME:
            now = token.data
        elif token.kind in (TokenKind.CHANGE_SCALAR, TokenKind.CHANGE_VECTOR):
            for name in names[token.data.id_code]:
                value = token.data.value
                found.setdefault(name, []).append((now, value if isinstance(value, int) else int(value, 2)))
    return found


def at(changes, time):
    return changes[bisect.bisect_right(changes, time, key=lambda change: change[0]) - 1][1]


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    from contactfpga.tools import cli

    folder = tmp_path_factory.mktemp("wave")
    (folder / "skin.toml").write_text(SMALL.to_toml())
    with contextlib.redirect_stdout(io.StringIO()) as printed:
        assert cli.main(["wave", "--skin", str(folder / "skin.toml"), "-o", str(folder / "touch.vcd"), "--json"]) == 0
    answer = json.loads(printed.getvalue())
    assert {*answer.pop("files")} == {str(folder / f"touch.{end}") for end in ("vcd", "gtkw", "sucl")}
    assert 0 < answer["touched_us"] < answer["sent_us"] < 1e6 * answer["clocks"] / SMALL.clock_hz
    assert answer["pressed"] == 4
    return folder


def test_the_line_carries_the_zone_that_is_pressed(written):
    signals = read_back((written / "touch.vcd").read_bytes())
    line, clock, bit = signals["bench.top.tx"], 10**15 // SMALL.clock_hz, round(10**15 / SMALL.baud)
    data, now, end = bytearray(), 0, line[-1][0]
    for start in [when for when, level in line if not level]:
        if start <= now:
            continue  # within a byte
        data.append(sum(at(line, start + bit * place + bit // 2) << place - 1 for place in range(1, 9)))
        now = start + 9 * bit + bit // 2
    assert now >= end - clock
    conversation = Conversation("the waveform")
    events = conversation.receive(protocol.encode_hello(SMALL) + bytes([0, *data]), 0.0)
    cells = wave.finger(SMALL)
    rows, columns = np.nonzero(cells)
    assert frames_in(events)[-1].frame.moments.tolist() == [[len(rows), columns.sum(), rows.sum()]]
    rows = signals["bench.top.row_cells"]
    pressed = {at(rows, when) for when, high in signals["bench.top.row_transfer"] if high}
    assert pressed == {0, *(int(sum(row << np.arange(5))) for row in cells if row.any())}


def test_it_begins_before_the_touch_and_ends_with_the_frame(written):
    signals = read_back((written / "touch.vcd").read_bytes())
    contact = signals["bench.top.contact"]
    scan = SMALL.derived.frame_clocks * 10**15 // SMALL.clock_hz
    assert contact[0] == (0, 0)
    (rise,) = [when for when, level in contact if level]
    assert scan <= rise <= 3 * scan
    assert all(changes[0][0] == 0 for changes in signals.values())


def test_a_gateware_that_is_wrong_is_reported_in_one_line(tmp_path, monkeypatch, run):
    def without_a_record(skin, timeline, cycles, **_):
        trace = golden.predict(skin, timeline, cycles)
        return dataclasses.replace(trace, records=trace.records[:-1])

    monkeypatch.setattr(wave.bench_amaranth, "run", without_a_record)
    (tmp_path / "skin.toml").write_text(SMALL.to_toml())
    status, out, errors = run("wave", "--skin", tmp_path / "skin.toml", "-o", tmp_path / "new" / "touch.vcd")
    assert (status, out, errors.count("\n")) == (1, "", 1)
    assert re.search(r"gateware and golden model differ: first difference at cycle \d+, boundary 'records'", errors)
    assert not (tmp_path / "new").exists()


def test_layouts_name_signals_that_are_there(written):
    signals = read_back((written / "touch.vcd").read_bytes())
    surfer = (written / "touch.sucl").read_text().split()
    gtkwave = (written / "touch.gtkw").read_text().splitlines()[2:]
    named = [word for word in surfer if word.startswith("bench")]
    assert named == [line.partition("[")[0] for line in gtkwave]
    assert {*named} <= {*signals}
    assert "bench.top.tx" in named


changes = st.lists(st.tuples(st.integers(1, 50), st.sampled_from("abc"), st.integers(0, 5)), max_size=40)


@given(changes, st.integers(0, 60))
def test_a_waveform_that_is_cut_has_the_values_of_the_whole_one(steps, begin):
    file = io.StringIO()
    with VCDWriter(file, timescale="1 fs", date="") as writer:
        variables = {
            name: writer.register_var("top", name, "wire", size=bits, init=0) for name, bits in zip("abc", (1, 3, 3))
        }
        for when, name, value in sorted(steps, key=lambda step: step[0]):
            writer.change(variables[name], when, value)
        writer.close(timestamp=100)
    whole = file.getvalue()
    cut = "".join(wave.cut(io.StringIO(whole), begin))
    before, after = (read_back(text.encode()) for text in (whole, cut))
    for name, values in before.items():
        for time in range(begin, 101):
            assert at(after[name], time - begin) == at(values, time)


def test_a_frame_of_another_size_or_of_nothing_is_refused(run, tmp_path):
    (tmp_path / "skin.toml").write_text(SMALL.to_toml())
    for shape, said in (((1, 4, 4), "4x4 cells, 0 of them pressed; the sheet has 4x5"), ((1, 4, 5), "0 of them")):
        np.save(tmp_path / "frames.npy", np.zeros(shape, bool))
        status, out, error = run(
            *("wave", "--skin", tmp_path / "skin.toml", "--pressed", tmp_path / "frames.npy", "-o", tmp_path / "x.vcd")
        )
        assert (status, out) == (1, "")
        assert said in error
        assert error.count("\n") == 1
    assert not (tmp_path / "x.vcd").exists()


def test_a_touch_of_masked_cells_alone_is_refused_in_time():
    cells = np.zeros((4, 5), bool)
    cells[0, 0] = True
    with pytest.raises(wave.WaveError, match="masked cells make none"):
        wave.simulate(SMALL, cells, None)


def test_a_test_of_a_stage_writes_waveforms_where_a_folder_is_named(monkeypatch, tmp_path, bench):
    from amaranth.hdl import Module, Signal

    m, count = Module(), Signal(4)
    m.d.sync += count.eq(count + 1)
    monkeypatch.setenv("CONTACTFPGA_WAVES", str(tmp_path))
    test = bench(m)
    test.watch(count)
    test.run(5)
    (file,) = tmp_path.iterdir()
    assert [value for _, value in read_back(file.read_bytes())["bench.top.count"]][:5] == [0, 1, 2, 3, 4]
