"""The numbers in the diagrams, which are committed drawings, are those of commands, pages and code."""

import contextlib
import io
import itertools
import json
import re
from pathlib import Path

import pytest
import svg_texts
import wire
from study_pages import section

from contactfpga.boards import wiring
from contactfpga.design import kits
from contactfpga.design.circuit import load_circuit
from contactfpga.design.cover import load_cover
from contactfpga.tools import cli
from contactfpga_sim.apps.latency.stages import ASSUMED_HOST_US
from contactfpga_sim.lab.kits import steps
from contactfpga_sim.verify import wave

DOCS = Path(__file__).resolve().parents[2] / "docs"
KIT = kits.kit("starter")
SKIN, TIMES = KIT.skin, KIT.skin.derived


def words(name):
    return svg_texts.read(DOCS / "images" / f"{name}.svg").words


def middle(one):
    return one.corners.mean(axis=0)


def with_numbers(name):
    return {one.text for one in words(name) if re.search(r"\d", one.text)}


def test_the_whole():
    """Each time is a median, with the worst in parentheses."""
    rows = re.findall(r"^\| starter \| closed switch to the [^|]*\|(.*)\|$", section("kits.md", "times"), re.MULTILINE)
    times = [[round(float(cell)) for cell in row.split("|")] for row in rows]
    row_us = 1e6 * (TIMES.settle_clocks + TIMES.release_clocks) / SKIN.clock_hz
    assert with_numbers("together") == {
        *(f"{median} µs ({worst})" for median, _, worst in times),
        f"foam on {SKIN.rows} x {SKIN.columns} switches,",
        f"{SKIN.pitch_x_mm:g} mm apart",
        f"{row_us:.1f} µs",
        f"decision of your program, {ASSUMED_HOST_US:.0f} µs assumed for it",
        f"Times since the switch closed: median, in parentheses the worst. {KIT.title}; simulated.",
    }


def test_each_step_of_the_assembly_has_its_picture(tmp_path):
    """As drawn today; in the last one, nothing but a switch and its plunger, or parts glued together, touches."""
    for path in steps.draw(tmp_path):
        assert path.read_bytes() == (DOCS / "images" / path.name).read_bytes()
        page = "soft.md" if path.name == "soft.svg" else "starter.md"
        assert f"(images/{path.name})" in (DOCS / page).read_text(encoding="utf-8")
    cover = load_cover(KIT.skin_path)
    every = {one.words.partition(",")[0].partition(" of ")[0]: one.boxes for one in steps.pieces(steps.layer(), cover)}
    caps, frame = every["caps"], every["frame"]
    for (left, low, right, high), (a, b, c, d) in itertools.product(caps, frame):
        assert max(a - right, left - c, b - high, low - d) > 0.049
    plug, link = every["plug"][0], every["link"][0]
    assert plug[1] - link[3] == pytest.approx(14.0)


@pytest.mark.slow
@pytest.mark.parametrize(("kit", "unit", "sent"), [("starter", "{:.0f} µs", "{:.0f}"), ("fast", "{:.0f} ns", "{:.1f}")])
def test_a_touch(kit, unit, sent, tmp_path):
    skin = kits.kit(kit).skin
    touch = wave.simulate(skin, wave.finger(skin), tmp_path / "touch.vcd")
    us = 1e6 / skin.clock_hz
    rises = us * (next(at for at, level in touch.trace.contact if level and at > touch.touched) - touch.touched)
    said = f"rises after {unit.format(rises * (1000 if 'ns' in unit else 1))}"
    ends = f"all is sent: {sent.format(us * (touch.ends - touch.touched))} µs"
    assert {said, ends, f"settles, {1e6 * TIMES.settle_clocks / SKIN.clock_hz:.2f} µs"} <= with_numbers("touch")


def test_the_wiring_is_the_table_that_the_command_prints():
    """Beside each pin of the board is the name of its wire, below the name of its connector."""
    said = io.StringIO()
    with contextlib.redirect_stdout(said):
        assert cli.main(["build", "--kit", "starter", "--wiring", "--json"]) == 0
    table = {one["wire"]: one["pin"] for one in json.loads(said.getvalue())["wires"] if one["pin"]}
    picture = words("wiring")
    connectors = {one.text: middle(one) for one in picture if one.text.startswith("PMOD")}
    shown = {}
    for one in picture:
        if one.text in table:
            x, y = middle(one)
            above = max((name for name, place in connectors.items() if place[1] < y), key=lambda n: connectors[n][1])
            row = [other for other in picture if abs(middle(other)[1] - y) < 3 and other.text.isdigit()]
            number = min(row, key=lambda other: abs(middle(other)[0] - x))
            shown[one.text] = f"{above} {number.text}"
    assert shown == table


def test_the_wiring_names_the_parts_on_the_sheet():
    circuit, chips = load_circuit(KIT.skin_path), {(one.chain, one.number) for one in wiring.outputs(SKIN)}
    series, pull = wiring.ohms(circuit.series_ohm), wiring.ohms(circuit.column_pull_ohm)
    said = f"{len(chips)} 74HC595, {series} in each line, {pull} from each column to 3.3 V."
    assert f"On the sheet already: {said}" in with_numbers("wiring")


def test_the_map_of_a_packet():
    """Each box with the size below it, by the encoder of the tests."""
    board = wire.Wire(SKIN)
    known, record, hello = board.known, board.record(1, 1, 1), board.hello_fields()
    moments = [("area", known.area_bits), ("sum_x", known.sum_x_bits), ("sum_y", known.sum_y_bits)]
    names = {
        getattr(wire, name): name.lower()
        for name in ("SHEET", "STATE", "PITCH", "FINGERPRINT", "RATES", "NAME", "CHECK")
    }
    boxes = [
        *(("COBS", 1), ("record", len(record)), ("trailer", len(board.trailer()) + 1), ("check", 3), ("zero", 1)),
        *(*moments, ("0", 8 * len(record) - sum(bits for _, bits in moments))),
        *(("time, µs", 24), ("sequence", 8), ("heard", 3), ("cells", known.area_bits), ("zones", known.zones_bits)),
        *(("overwritten", board.overwritten_bits), ("flags", 4), ("kind", 4)),
        *(("0-6", 7), ("1", 1), ("7-13", 7), ("1", 1), ("14-15", 2), ("0", 5), ("1", 1)),
        *((f"{one[0]} {names[one[0]]}", f"{one[1]} bytes") for one in hello),
    ]
    said = [one.text for one in words("packet")]
    short = [text for text in said if len(text) < 20]
    assert list(zip(short[::2], short[1::2], strict=True)) == [(name, str(size)) for name, size in boxes]
    assert sum(size for _, size in boxes[:5]) == len(board.zones([(1, 1, 1)]))
    assert f"Hello of the same board, {len(board.hello())} bytes: fields in the order sent" in said
    flags = ", ".join(f"{value} {name}" for name, value in wire.FLAGS.items())
    assert any(text.startswith(f"flags: {flags}. ") for text in said)
