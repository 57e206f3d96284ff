"""Predictions of the kits and the pages written from them."""

import dataclasses
import datetime
import io
import random
import re
import tomllib
from collections import Counter
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest
import trimesh
from scipy import ndimage

from contactfpga.design import kits, predictions
from contactfpga.design.circuit import falling, needed
from contactfpga.design.cover import load_cover
from contactfpga.design.kits import KitError
from contactfpga.design.predictions import Prediction
from contactfpga.design.sheet import orders
from contactfpga.design.sheet.caps import caps, feet, stl
from contactfpga.design.sheet.extract import extracted
from contactfpga_sim.apps.latency import board as latency
from contactfpga_sim.lab.arm import kits as kits_arm
from contactfpga_sim.lab.arm.places import Peaks
from contactfpga_sim.lab.kits import counts, predict, sensitivity, tables
from contactfpga_sim.model.board.compiled import CompiledBoard
from contactfpga_sim.model.scenes.families import placements

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
    circuit = extracted(kit.layout).circuit
    if kit.skin.ruler:
        assert found["sample_us"].value == pytest.approx(found["ruler_us"].value * kit.skin.ruler / 16, rel=1e-4)
        fallen_us = 1e6 * falling.fall_s(circuit, found["level_ohm"].value, kit.skin.row_lines)[0]
        assert found["sample_us"].value == pytest.approx(fallen_us, rel=0.01)
    else:
        needs = needed(circuit, kit.skin.row_lines, kit.skin.column_lines)
        assert found["settle_us"].value == pytest.approx(1e6 * needs.settle.seconds, rel=1e-4)
        assert found["row_ma"].value == pytest.approx(needs.pressed.pin_ma, rel=1e-4)
    some = latency.measure(kit.skin, touches=12)
    assert some.touch_to_last_byte_us.worst <= found["last_byte_worst_us"].high
    assert some.bytes == found["frame_bytes"].value
    level = predict.pressing(load_cover(kit.skin_path), {"spread": 0.0})
    for name, value in predict.measured(level, kit.skin, 0).items():
        if not name.startswith("felt_"):
            assert found[name].value == pytest.approx(value, rel=1e-4)


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
    rng = np.random.default_rng(5)
    for tolerance in (*predict.CIRCUIT.values(), *predict.COVER.values()):
        drawn = np.array([tolerance.drawn(rng) for _ in range(200)])
        edge = 0.1 * (tolerance.high - tolerance.low)
        assert tolerance.low <= drawn.min() < tolerance.low + edge
        assert tolerance.high - edge < drawn.max() <= tolerance.high


@pytest.mark.parametrize("key", predict.COVER)
def test_each_assumption_of_the_cover_moves_a_prediction(key, monkeypatch):
    """By 1 % or more at its limit; the tilt of caps by as much as one of them has of its own."""
    monkeypatch.setattr(predict, "ANYWHERE", 10)
    kit = kits.kit("starter")
    cover, factor = load_cover(kit.skin_path), predict.TILT if key == "tilt" else predict.COVER[key].high
    usual, moved = (predict.measured(predict.pressing(cover, of), kit.skin, 1) for of in ({}, {key: factor}))
    assert usual.keys() == predict.MEASURED.keys()
    assert max(abs(moved[name] / usual[name] - 1) for name in usual) > (0.001 if key == "tilt" else 0.01)


@pytest.mark.slow  # a second each
@pytest.mark.parametrize("key", predict.CIRCUIT)
def test_each_assumption_of_the_circuit_moves_a_prediction(key, monkeypatch):
    """With all others as stated, and itself at its end."""
    level = dict.fromkeys(predict.CIRCUIT, predict.Tolerance("", 1.0, 1.0))
    one = predict.CIRCUIT[key]
    far = one.low if key == "switch_ohm" else one.high
    monkeypatch.setattr(predict, "CIRCUIT", level | {key: predict.Tolerance("", far, far)})
    monkeypatch.setattr(predict, "DRAWS", 1)
    found = [*predict._circuit(kits.kit("fast"))]
    assert max(each.high / each.low for each in found) > 1.001


@pytest.mark.slow
def test_each_change_of_the_page_moves_a_headline():
    usual = sensitivity.headlines({}, touches=2, scenes=10)
    for change in (one for both in sensitivity.CHANGES.values() for one in both):
        moved = sensitivity.headlines(change, touches=2, scenes=10)
        least = 1e-3 if "tilt" in change else 5e-3
        assert max(abs(now / before - 1) for now, before in zip(moved[:4], usual[:4], strict=True)) > least, change


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


def test_peak_forces_in_the_readme_are_those_of_a_kits_own_cover(tmp_path, monkeypatch):
    """With made-up forces: the foam's thickness in mm, 10 N more of a rigid body, 100 N more of each way."""

    def force(one, way):
        return 1e3 * one.case.cover.thickness_m + 10 * (one.case.body == "rigid") + 100 * way

    def made_up(study, workers):
        return {
            each: [[Peaks(np.array([force(one, way)]), None, None, None)] * 2 for way in (1, 2, 3, 4)]
            for each, (one, _) in study.items()
        }

    monkeypatch.setattr(kits_arm, "ways", lambda skin, finger: ((),) * 4)
    monkeypatch.setattr(kits_arm.anywhere, "ways", lambda case, skin: ((),) * 4)
    monkeypatch.setattr(kits_arm.anywhere, "many", made_up)
    text = kits.kit("starter").skin_path.read_text()
    (tmp_path / "skin.toml").write_text(text.replace("thickness_m = 0.002", "thickness_m = 0.003"))
    thick = dataclasses.replace(kits.kit("starter"), folder=tmp_path)
    rows = list(tables._peak_rows([tables.KitFigures(thick, None, ())]))
    assert [row[1] for row in rows] == [
        f"both **{n}03.0 / {n}03.0 N** forearm, **{n}13.0 / {n}13.0 N** rigid" for n in "214"
    ]
    assert all("05.0 / " in row[2] for row in rows)


def test_the_tutorial_lists_the_parts_of_the_starter_kit():
    page = Path("docs/starter.md").read_text(encoding="utf-8")
    kit = kits.kit("starter")
    placed = kit.layout.drawing.placed
    counted = Counter((one.part.name, one.value if one.value.isdigit() else "") for one in placed if one.value)
    wanted = sorted((count, float(value or 0)) for (_, value), count in counted.items())
    numbers = {one.part.number(one.value) for one in placed}
    assert all(number in page for number in numbers)
    rows = re.findall(r"^\| (\d+) \| [^|]* \| (?:(\d+) (k?)Ω )?\|$", page, re.MULTILINE)
    assert sorted((int(count), float(ohm or 0) * (1000 if kilo else 1)) for count, ohm, kilo in rows) == wanted
    beside = re.findall(r"^\| (\d+) \| ([^|]*) \|$", page, re.MULTILINE)
    assert [int(count) for count, _ in beside] == [part.count for part in kit.parts]
    assert all(part.number in what for part, (_, what) in zip(kit.parts, beside, strict=True))


@pytest.mark.parametrize(("name", "column"), [("starter", 1), ("fast", 2)])
def test_size_mass_and_height_of_a_kit_are_those_of_its_files(name, column):
    """Printed parts are measured by trimesh, the board's outline by its file's corners; the bed carries this mass."""
    kit, page = kits.kit(name), Path("docs/kits.md").read_text(encoding="utf-8")
    rows = [
        line.split("|")[1:-1] for line in page.splitlines() if re.match(r"\| (board of the|height|mass|the same)", line)
    ]
    board, height, mass, square = (row[column].strip() for row in rows)
    found = re.search(r"^size: +(\S+) x (\S+) mm", orders.note(kit.layout), re.MULTILINE)
    width, length = map(float, found.groups())
    cover = load_cover(kit.skin_path)
    layer = caps(kit.skin, kit.layout.switch, 1e3 * cover.cap.side_m)
    prints = [
        trimesh.load(io.BytesIO(stl(body)), file_type="stl")
        for body in (layer.caps(), layer.frame(), feet(cover.bed.pad_mm))
    ]
    foam_mm, bed_mm, side_mm = (
        1e3 * cover.thickness_m,
        1e3 * cover.bed.thickness_m,
        kit.skin.columns * kit.skin.pitch_x_mm,
    )
    foam_mm3 = side_mm**2 * foam_mm + 1e6 * cover.bed.area_m2 * bed_mm
    grams = [width * length * 1.6 * 1.85e-3, sum(one.volume for one in prints) * 1.1e-3, foam_mm3 * 33e-6]
    assert board == f"{width:.1f} x {length:.1f} mm"
    assert mass == "{:.0f} + {:.0f} + {:.1f} g".format(*grams)
    assert square == f"{sum(grams) / side_mm**2 * 1e3:.1f} kg"
    assert 1e3 * cover.bed.mass_kg == pytest.approx(sum(grams), rel=0.1)
    below, above = (
        5 + np.ptp(prints[2].bounds[:, 2]) + bed_mm,
        kit.layout.switch.height_mm + np.ptp(prints[0].bounds[:, 2]),
    )
    assert height == f"{below + 1.6 + above + foam_mm:.1f} mm"


def test_a_scene_is_miscounted_whose_zones_are_not_as_many_as_its_contacts():
    """The oracle is scipy's: fingers 5 mm apart are as many contacts."""
    kit = kits.kit("starter")
    cover, drawn = load_cover(kit.skin_path), counts.Drawn("light fingers", "fingers", 60, (0.5, 1.5))
    with ThreadPoolExecutor(1) as workers:
        found = counts.miscounted(kit.skin, cover, drawn, workers)
    scenes = placements("fingers", 60, counts.SEED, kit.skin, force_n=(0.5, 1.5))
    wrong = [ndimage.label(one.pressed(0.0, kit.skin, cover))[1] != len(one.contacts) for one in scenes]
    assert 0 < found.hits == sum(wrong) < found.of == 60
