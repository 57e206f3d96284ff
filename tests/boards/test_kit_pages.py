"""Predictions of the kits and the pages written from them."""

import dataclasses
import datetime
import random
import re
import tomllib
from collections import Counter
from pathlib import Path

import numpy as np
import pytest

from contactfpga.design import kits, predictions
from contactfpga.design.circuit import load_circuit, needed
from contactfpga.design.cover import load_cover
from contactfpga.design.kits import KitError
from contactfpga.design.predictions import Prediction
from contactfpga.design.sheet import lay_out
from contactfpga.design.sheet.extract import extracted
from contactfpga_sim.apps.latency import board as latency
from contactfpga_sim.lab.kits import predict
from contactfpga_sim.model.board.compiled import CompiledBoard

ONE = Prediction(
    "settle_us", "what", "us", 1.0, 0.5, 2.0, "circuit", "contactfpga settle", datetime.date(2026, 11, 24), "abc"
)


@pytest.mark.parametrize("name", kits.names())
def test_a_kit_has_predictions_of_each_model(name):
    found = predictions.load(kits.kit(name))
    assert len(found) >= 25
    assert {one.model for one in found.values()} == {"gateware", "bridge", "circuit", "cover"}
    for one in found.values():
        assert one.low <= one.value <= one.high
        assert one.command.startswith(("contactfpga ", "python -m contactfpga_sim.lab.kits.predict "))
        assert re.fullmatch("[0-9a-f]{8}", one.commit)


@pytest.mark.slow
@pytest.mark.parametrize("name", kits.names())
def test_predictions_are_what_is_computed_today(name):
    """The cheap ones, each by other means than the file's: circuit by its model, times by a part of the touches."""
    kit = kits.kit(name)
    found = predictions.load(kit)
    circuit = extracted(lay_out(kit.skin, load_circuit(kit.skin_path))).circuit
    needs = needed(circuit, kit.skin.row_lines, kit.skin.column_lines)
    assert found["settle_us"].value == pytest.approx(1e6 * needs.settle.seconds, rel=1e-4)
    assert found["row_ma"].value == pytest.approx(needs.pressed.pin_ma, rel=1e-4)
    some = latency.measure(kit.skin, touches=12)
    assert some.touch_to_last_byte_us.worst <= found["last_byte_worst_us"].high
    assert some.bytes == found["frame_bytes"].value
    felt = predict.closing_n(load_cover(kit.skin_path), 1e-3 * kit.skin.pitch_x_mm, 0)
    for number, force in enumerate(felt):
        assert found[f"closing_{number}_n"].value == pytest.approx(force, rel=1e-4)


@pytest.mark.slow
@pytest.mark.parametrize("name", kits.names())
def test_breaks_of_any_line_at_any_time_are_reported_as_predicted(name):
    """40 breaks on the compiled board: none takes longer, and their median is that of as many chances."""
    kit, rng = kits.kit(name), random.Random(1)
    clocks, found = kit.skin.clock_hz // 10**6, []
    with CompiledBoard(kit.skin, ["contact"]) as board:
        for _ in range(40):
            board.cut({}, {})
            board.restart()
            board.run(rng.randrange(700 * clocks, 1300 * clocks))
            board.take("contact")
            cut, start = {rng.randrange(kit.skin.rows): 0}, board.cycle
            board.cut(*rng.choice([(cut, {}), ({}, cut)]))
            board.run(700 * clocks)
            found.append((int(board.take("contact")["cycle"][0]) - start) / clocks)
    predicted = predictions.load(kit)
    assert max(found) <= predicted["break_worst_us"].high
    assert np.median(found) == pytest.approx(predicted["break_median_us"].value, rel=0.4)


def test_draws_are_spread_about_what_is_stated():
    kit = kits.kit("starter")
    circuit, cover = load_circuit(kit.skin_path), load_cover(kit.skin_path)
    rng = np.random.default_rng(5)
    lines = np.array([predict.drawn_circuit(circuit, rng).line_pf for _ in range(200)]) / circuit.line_pf
    forces = np.array([predict.drawn_cover(cover, rng).switch.force_n for _ in range(200)]) / cover.switch.force_n
    for drawn, share in ((lines, 0.3), (forces, 0.1)):
        assert 1 - share <= drawn.min() < 1 - 0.9 * share
        assert 1 + 0.9 * share < drawn.max() <= 1 + share


def test_a_changed_prediction_is_a_new_entry_that_counts_and_no_edit(tmp_path):
    text = predictions.added("# head\n", {"settle_us": ONE})
    assert predictions.added(text, {"settle_us": dataclasses.replace(ONE, commit="def")}) == text
    changed = predictions.added(text, {"settle_us": dataclasses.replace(ONE, value=1.5)})
    assert changed.startswith(text.rstrip())
    entries = tomllib.loads(changed)["prediction"]
    assert [entry["value"] for entry in entries] == [1.0, 1.5]
    assert Prediction(**entries[0]) == ONE
    (tmp_path / predictions.FILE).write_text(changed)
    assert predictions.load(dataclasses.replace(kits.kit("starter"), folder=tmp_path))["settle_us"].value == 1.5


def test_a_file_that_is_wrong_is_refused(tmp_path):
    kit = dataclasses.replace(kits.kit("starter"), folder=tmp_path)
    file = tmp_path / predictions.FILE
    file.write_text(predictions.added("", {"settle_us": dataclasses.replace(ONE, low=1.2)}))
    with pytest.raises(KitError, match=r"settle_us is 1, outside its interval 1\.2 to 2"):
        predictions.load(kit)
    file.write_text("[[prediction]]\nnome = 1\n")
    with pytest.raises(KitError, match=r"unknown key 'nome' in \[prediction\]; did you mean 'name'\?"):
        predictions.load(kit)


def test_the_tutorial_lists_the_parts_of_the_starter_kit():
    page = Path("docs/starter.md").read_text(encoding="utf-8")
    kit = kits.kit("starter")
    placed = lay_out(kit.skin, load_circuit(kit.skin_path)).drawing.placed
    counted = Counter((one.part.order.split(",")[0], one.value) for one in placed)
    wanted = sorted((count, float(value) if value.isdigit() else 0.0) for (_, value), count in counted.items())
    rows = re.findall(r"^\| (\d+) \| [^|]* \| (?:(\d+) (k?)Ω )?\|$", page, re.MULTILINE)
    assert sorted((int(count), float(ohm or 0) * (1000 if kilo else 1)) for count, ohm, kilo in rows) == wanted
    beside = re.findall(r"^\| (\d+) \| ([^|]*) \|$", page, re.MULTILINE)
    assert [int(count) for count, _ in beside] == [part.count for part in kit.parts]
    assert all(part.number in what for part, (_, what) in zip(kit.parts, beside, strict=True))
