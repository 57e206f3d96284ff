"""What a layout's lines come to, against field solutions, a loop's resistance, and the circuit's own file."""

import itertools
import math

import numpy as np
import pytest

from contactfpga import Skin
from contactfpga.design.circuit import Circuit, load_circuit
from contactfpga.design.sheet import SheetError, extract, files, lay_out
from contactfpga.design.sheet.drawing import Drawing

EPS0 = 8.8541878128e-3  # pF/mm


def strips(pieces, pairs):
    """Capacitance matrix per length in pF/mm of flat conductors in vacuum, by the method of moments: each of ``pieces``
    is (x from, x to, z), cut into strips of even charge, and a conductor is a list of pieces. The total charge is zero,
    so capacitances are between conductors."""
    where, ends, owner = [], [], []
    for number, conductor in enumerate(pieces):
        for low, high, z in conductor:
            edges = low + (high - low) * (1 - np.cos(np.linspace(0, math.pi, 121))) / 2
            for a, b in itertools.pairwise(edges):
                where.append(((a + b) / 2, z))
                ends.append((a, b))
                owner.append(number)
    where, ends, owner = np.array(where), np.array(ends), np.array(owner)

    def log_mean(x, z, a, b):
        """Mean of ln(r) over a strip."""

        def anti(u):
            r2 = u * u + z * z
            part = np.where(r2 > 0, u * np.log(np.maximum(r2, 1e-300)) / 2, 0.0)
            return part - u + np.abs(z) * np.arctan2(u, np.abs(z))

        return (anti(b - x) - anti(a - x)) / (b - a)

    dz = where[:, None, 1] - where[None, :, 1]
    potential = -log_mean(where[:, None, 0], dz, ends[None, :, 0], ends[None, :, 1]) / (2 * math.pi * EPS0)
    n, conductors = len(where), len(pieces)
    system = np.zeros((n + 1, n + 1))
    system[:n, :n], system[:n, n], system[n, :n] = potential, 1.0, 1.0  # an unknown level, and no charge in all
    found = {}
    for a, b in pairs:
        volts = np.append((owner == a).astype(float), 0.0)
        charges = np.linalg.solve(system, volts)[:n]
        found[a, b] = -charges[owner == b].sum()
    assert conductors
    return found


@pytest.mark.parametrize(
    ("width", "other", "gap"), [(0.2, 0.2, 6.2), (4.5, 4.5, 1.9), (0.2, 4.52, 0.84), (0.2, 0.2, 0.4)]
)
def test_two_tracks_beside_each_other(width, other, gap):
    pieces = [[(0.0, width, 0.0)], [(width + gap, width + gap + other, 0.0)]]
    expected = strips(pieces, [(0, 1)])[0, 1]
    assert extract.beside_pf(width, other, gap, 1.0) == pytest.approx(expected, rel=0.01)


@pytest.mark.parametrize("ratio", [0.1, 0.5, 2.0, 20.0])
def test_a_track_over_a_plane(ratio):
    # in vacuum a plane is a mirror: two tracks, twice the distance, half the capacitance
    pieces = [[(0.0, ratio, 0.0)], [(0.0, ratio, 2.0)]]
    expected = 2 * strips(pieces, [(0, 1)])[0, 1]
    assert extract.over_pf(ratio, 1.0, 1.0) == pytest.approx(expected, rel=0.01)


def test_a_track_over_a_plane_on_a_board():
    # a line of 50 ohm on FR-4 of permittivity 4.4 is 1.91 times as wide as the board is thick, its permittivity 3.3
    expected = math.sqrt(3.33) / (299.792458 * 50.0) * 1e3  # pF/mm: sqrt(e) / (c Z)
    assert extract.over_pf(1.91, 1.0, 4.4) == pytest.approx(expected, rel=0.01)


def test_wide_tracks_that_cross_are_a_plate_capacitor():
    assert extract.across_pf(80.0, 60.0, 1.0, 4.0) == pytest.approx(EPS0 * 4 * 80 * 60, rel=0.1)


def test_the_resistance_of_a_line_with_a_loop_in_it():
    # 10 mm, a square loop of 4 mm whose halves are in parallel, 10 mm: 10 + 8 / 2 + 10 = 24 mm of 0.2 mm
    drawing = Drawing()
    drawing.run("A", "F", (0, 0), (0, 10))
    drawing.run("A", "F", (0, 10), (2, 10), (2, 14), (0, 14))
    drawing.run("A", "F", (0, 10), (-2, 10), (-2, 14), (0, 14))
    drawing.run("A", "F", (0, 14), (0, 24))
    assert extract._ohms(drawing, "A", 0.0) == pytest.approx(0.49e-3 * 24 / 0.2, rel=1e-9)


def test_a_via_joins_the_sides_of_a_line():
    drawing = Drawing()
    drawing.run("A", "F", (0, 0), (0, 10))
    drawing.via("A", 0, 10)
    drawing.run("A", "B", (0, 10), (5, 10))
    assert extract._ohms(drawing, "A", 0.0) == pytest.approx(0.49e-3 * 15 / 0.2 + 1e-3, rel=1e-9)  # 1 mohm the via


def test_a_meter_of_cable_is_50_pf():
    layout = lay_out(Skin(rows=4, columns=4))
    near, far = (extract.extracted(layout, cable_m).circuit.line_pf for cable_m in (0.0, 1.0))
    assert far - near == pytest.approx(50, abs=0.5)


def test_the_completed_file_keeps_all_else(tmp_path):
    text = (
        "rows = 4 # four\ncolumns = 5\n\n[circuit]\nseries_ohm = 47 # mine\n[circuit.diode]\nsaturation_a = 1e-7\n"
        "[cover]\nthickness_m = 0.002\n"
    )
    done = tmp_path / "skin.toml"
    done.write_text(files.completed(text, Circuit(series_ohm=47, line_pf=31.5)))
    assert "rows = 4 # four\n" in done.read_text()
    assert "[cover]\nthickness_m = 0.002" in done.read_text()
    assert Skin.load(done) == Skin(rows=4, columns=5)
    assert load_circuit(done) == Circuit(series_ohm=47, line_pf=31.5)


@pytest.mark.parametrize("text", ["circuit = {series_ohm = 47}\nrows = 4\n", "circuit.series_ohm = 47\nrows = 4\n"])
def test_a_circuit_in_another_form_is_refused(text):
    with pytest.raises(SheetError, match=r"write it as a table \[circuit\]"):
        files.completed(text, Circuit())
