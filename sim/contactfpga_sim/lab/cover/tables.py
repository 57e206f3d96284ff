"""Tables and pictures of docs/cover.md and docs/paper.md."""

from __future__ import annotations

import math
from pathlib import Path
from typing import NamedTuple

from contactfpga.design.cover import drawing, elastic, impact, medium, point
from contactfpga.design.cover.answer import NoSolution
from contactfpga.design.cover.arm import GRAVITY, Arm
from contactfpga.design.cover.design import thinning
from contactfpga.design.cover.foams import FOAMS
from contactfpga.design.cover.hertz import Ball
from contactfpga.design.cover.impact import Impact
from contactfpga.design.cover.layers import BODIES
from contactfpga.design.cover.task import FIRST_DESIGN, WORST_M
from contactfpga_sim.lab import writer
from contactfpga_sim.lab.cover import caps, formulas

ARM, SWITCH = FIRST_DESIGN.arm, FIRST_DESIGN.switch
HEAVY = Arm.link(2.0, 0.038, 0.15, 0.2)
PRINTED_PA = 3.65e5
FOAM_PA = 3.45e5
RESILIENCE = 4791.0


class PaperClaim(NamedTuple):
    printed: str
    ours: str
    verdict: str


def rows() -> list[PaperClaim]:
    return [*_equations(), *_first_design(), *_thickness(), *_sensitivity(), *_experiment()]


def _equations() -> list[PaperClaim]:
    weight = 0.6 * GRAVITY * 0.15
    dropped = 2 * 0.2**2 * weight / ARM.inertia_kgm2
    return [
        PaperClaim("δ̇(0) = −v₀", "+v₀, as θ − θ₀ = δ/d; with the printed sign δ^1.5 has no real value", "misprint"),
        PaperClaim(
            "gravity in (3), (4), (5): cos θ₀ dropped at the lower limit",
            f"2d²Mgl/J = {dropped:.2f} m²/s² against v₀² = 0.16",
            "wrong; the difference of cosines is taken",
        ),
        PaperClaim(
            '"no analytical expression" of E* from t_c',
            f"t_c = {impact.COMPRESSION_TIME:.9f} δ_c/v₀ without torque and gravity",
            "true with either, false without",
        ),
    ]


def _first_design() -> list[PaperClaim]:
    wanted = _solved(impact.stiffness_for(ARM, 0.4, 0.008))
    hits = [
        _solved(impact.strike(ARM, 0.4, _stiffness(PRINTED_PA, radius, poisson)))
        for radius in (0.019, 0.038)
        for poisson in (0.3, 0.5)
    ]
    depths = sorted(1e3 * hit.compression_m for hit in hits)
    times = sorted(1e3 * hit.time_s for hit in hits)
    return [
        PaperClaim(
            "E_B = 3.65·10⁵ Pa and δ_c = 3.2 mm for τ = 8 ms",
            f"8 ms needs δ_c = {1e3 * wanted.compression_m:.3f} mm; 3.65·10⁵ Pa gives {depths[0]:.2f} to "
            f"{depths[-1]:.2f} mm in {times[0]:.1f} to {times[-1]:.1f} ms; v₀τ = {1e3 * 0.4 * 0.008:.1f} mm",
            "does not reproduce",
        )
    ]


def _thickness() -> list[PaperClaim]:
    rules = elastic.THICKNESS_RULES
    printed = elastic.resilience(8.41e5, FOAM_PA)
    implied = math.sqrt(2 * FOAM_PA * RESILIENCE)
    foam = elastic.effective_modulus_pa(FOAM_PA, 0.5)
    near, far = (_as_printed(radius) for radius in (0.038, 0.019))
    vacuous = [
        elastic.yield_indentation_m(Ball(1.0, elastic.effective_modulus_pa(modulus, poisson)), 8.41e5, ratio)
        for modulus in (FOAM_PA, PRINTED_PA)
        for poisson in (0.5, 0.0)
        for ratio in (elastic.BETWEEN_SPHERES, elastic.CYLINDER_ON_PLANE)
    ]
    real = [
        elastic.yield_indentation_m(Ball(1.0, foam), 57.5e3, ratio)
        for ratio in (elastic.BETWEEN_SPHERES, elastic.CYLINDER_ON_PLANE)
    ]
    deep = [
        _solved(impact.strike(HEAVY, 1.5, _stiffness(FOAM_PA, radius, 0.5))).compression_m for radius in (0.038, 0.019)
    ]
    return [
        PaperClaim(
            "U_r = 4791 J/m³ = Y²/(2E)",
            f"Y = 8.41·10⁵ Pa gives {1e-6 * printed:.3f}·10⁶ J/m³; 4791 means Y = {1e-3 * implied:.1f} kPa",
            "inconsistent",
        ),
        PaperClaim(
            "S_c = 1.3π (F R*/E*)^(2/3)",
            f"{1.5 ** (2 / 3):.4f}π for crossed equal cylinders with R_B for R*, {0.75 ** (2 / 3):.4f}π for a circle "
            "on R*",
            "holds in the first reading only",
        ),
        PaperClaim(
            "F = ((8/15)² E_k³ E*² R*)^(1/5)",
            f"this is W/δ, coefficient {(8 / 15) ** 0.4:.4f}; the peak force has {2.5 * (8 / 15) ** 0.4:.4f}",
            "low by 5/2",
        ),
        PaperClaim(
            "84 in (8)",
            f"{rules['printed_exact']:.4f}; {rules['peak_force']:.3f} with the peak force; {rules['hertz']:.3f} with "
            "Hertz's area, too",
            "holds for the printed F",
        ),
        PaperClaim(
            "e = 7.90 mm", f"{near:.3f} mm (R* = 38 mm, t₀ = 8 ms) or {far:.2f} mm (R* = 19 mm)", "near, not exact"
        ),
        PaperClaim(
            "yield check (6), (7) with Y = 8.41·10⁵ Pa",
            f"δ_Y/R* = {math.floor(min(vacuous))} to {max(vacuous):.0f}; with 57.5 kPa {real[0]:.5f} (ν_Y = 1.1) or "
            f"{real[1]:.5f} (1.5)",
            "vacuous as printed",
        ),
        PaperClaim(
            "second design: 2 kg, 1.5 m/s, 7.9 mm of foam",
            f"pressed in by {1e3 * deep[0]:.1f} to {1e3 * deep[1]:.1f} mm",
            "the cover bottoms out",
        ),
    ]


def _sensitivity() -> list[PaperClaim]:
    force, reach = point.force_n, point.reach_m
    worst = _number(force(SWITCH, WORST_M, 5e-3))
    layer = _number(force(SWITCH, WORST_M, 5e-3, "bonded"))
    ratios = [float(medium.exact_spread("bonded", s) / medium.spread("halfspace", s)) for s in (0.0, 1.414)]
    near, far = (1e3 * _number(reach(SWITCH, newtons, 5e-3)) for newtons in (15, 3 / 0.19))
    thick = _number(force(SWITCH, 0.0, 10e-3))
    return [
        PaperClaim("Fig. 8: 65 N, 5√2 mm from the switch, 5 mm thick", f"{worst:.4f} N", "holds"),
        PaperClaim(
            "Fig. 8: at least 45 N over the thickness",
            f"{point.least_force_n(SWITCH, WORST_M):.4f} N at {1e3 * point.best_thickness_m(WORST_M):.4f} mm",
            "holds",
        ),
        PaperClaim("12 N → 3.6 mm", f"{1e3 * _number(reach(SWITCH, 12, 5e-3)):.4f} mm", "holds"),
        PaperClaim(
            "15 N → 4.2 mm → definition 5.9 mm",
            f"{near:.4f} mm at 15 N → {math.sqrt(2) * near:.3f} mm; {far:.4f} mm at 3 Nm/0.19 m = {3 / 0.19:.3f} N",
            "levers 0.19 and 0.20 m mixed",
        ),
        PaperClaim('"six degree polynomial"', "(ρ² + z²)^(5/2): degree 5", "wording"),
        PaperClaim(
            "half-space (9) for foam on a rigid bumper",
            f"a bonded layer has {ratios[0]:.3f} of its stress on the axis, {ratios[1]:.3f} at ρ/h = 1.414: "
            f"{layer:.0f} N, not 65 N, at the worst place",
            "the model fails there",
        ),
        PaperClaim(
            "10 mm of cover under the limit of 15 N", f"nothing below {thick:.2f} N is detected", "fails its own limit"
        ),
    ]


def _experiment() -> list[PaperClaim]:
    stiffness = _stiffness(FOAM_PA, 0.038, 0.5)
    closed = (12 / stiffness) ** (2 / 3)
    reacted = closed + 0.4 * 0.006
    return [
        PaperClaim(
            "2.3 Nm → 12 N; 3 Nm → 15 N; 45 N → 8.5 Nm",
            f"{2.3 / 0.19:.2f} or {2.3 / 0.2:.1f}; {3 / 0.19:.2f} or {3 / 0.2:.2f}; "
            f"{0.19 * point.least_force_n(SWITCH, WORST_M):.2f} or {0.2 * point.least_force_n(SWITCH, WORST_M):.2f}",
            "levers 0.19 and 0.20 m mixed",
        ),
        PaperClaim(
            "switch closes at 12 N, 0.4 m/s, 6 ms, 5 mm of foam",
            f"reaction at {1e3 * reacted:.2f} mm and {stiffness * reacted**1.5:.1f} N, stop 5 ms later at "
            f"{1e3 * (reacted + 0.2 * 0.005):.2f} mm",
            "not all true at once",
        ),
    ]


def _as_printed(radius_m: float) -> float:
    """Equation (8), in mm, with t0 = 8 ms on the second design."""
    ball = Ball(radius_m, elastic.effective_modulus_pa(FOAM_PA, 0.5))
    hit = _solved(impact.strike(HEAVY, 1.5, elastic.stiffness(ball)))
    return 1e3 * elastic.thickness_m(ball, 2.0, 1.5, RESILIENCE, 0.008 / hit.time_s)


def _stiffness(modulus_pa: float, radius_m: float, poisson: float) -> float:
    return elastic.stiffness(Ball(radius_m, elastic.effective_modulus_pa(modulus_pa, poisson)))


def _solved(answer: Impact | NoSolution) -> Impact:
    assert isinstance(answer, Impact), answer
    return answer


def _number(answer: float | NoSolution) -> float:
    assert not isinstance(answer, NoSolution), answer
    return answer


def sense_table() -> str:
    study = formulas
    rows = [["model", "ball", *(f"ρ/h = {place:g}" for place in study.PLACES)]]
    for model in study.LADDER:
        for name, ball in study.BALLS.items():
            errors = ["0" if error == 0 else f"{100 * error:+.1f} %" for error in study.sense_errors(model, ball)]
            rows.append([str(model), name, *errors])
    return writer.table_of(rows)


def body_table() -> str:
    rows = [["body", "flesh", "E", "depth", "source"]]
    for name, depth_m, flesh, source in BODIES.values():
        soft = ["none", ""]
        if flesh is not None:
            soft = [f"{1e3 * flesh.thickness_m:g} mm", f"{1e-3 * flesh.modulus_pa:g} kPa"]
        rows.append([f"`{name}`", *soft, f"{1e3 * depth_m:g} mm", source])
    return writer.table_of(rows)


AREAS_AT_N = (0.25, 1.0, 2.0, 7.0)


def fingertip_table() -> str:
    """The modeled fingertip beside published ones, of which nothing has set it."""
    tip, finger = formulas.fingertip(), formulas.pressed_finger()
    areas = [f"{1e6 * finger.parts_at(finger.depth_m(force))[0].area_m2:.0f}" for force in AREAS_AT_N]
    pawluk = "[Pawluk and Howe 1999](https://doi.org/10.1115/1.2800860)"
    rows = [
        (f"correlation of ln F with depth, to {formulas.HARDEST_N:g} N", "exponential", 1.0, tip.exponential, pawluk),
        ("largest difference of the pressure from a paraboloid's, of its peak", "none", 0.0, tip.paraboloid, pawluk),
        (
            "correlation of the secant modulus F/d^1.5 with F",
            "straight line",
            1.0,
            tip.secant,
            "[Dzidek et al. 2017](https://doi.org/10.1098/rsif.2016.0935), figure 7",
        ),
        (
            "power of F with which the depth grows",
            "2/3",
            2 / 3,
            tip.power,
            "[a fingerpad by Hertz, 2001](https://koreascience.kr/article/JAKO200111919995062.page)",
        ),
    ]
    lines = [
        (what, theirs, f"{ours:.3f}", f"{ours - value:+.3f}", source) for what, theirs, value, ours, source in rows
    ]
    at = ", ".join(f"{force:g}" for force in AREAS_AT_N)
    area = (f"area at {at} N, mm²", "not read", ", ".join(areas), "", "Serina et al. 1998, J Biomech 31, 639")
    return writer.table_of([("what", "published", "model", "deviation", "source"), *lines, area])


DISAGREES = ("wrong;", "inconsistent", "low by", "vacuous", "the cover bottoms", "the model fails", "fails its own")
"""Beginnings of the verdicts that the page shows."""


def paper_table() -> writer.Table:
    lines = [(row.printed, row.ours, row.verdict) for row in rows()]
    return writer.Table(("paper says", "we get", "verdict"), lines, lambda row: row[2].startswith(DISAGREES))


def thinning_table() -> str:
    head = (
        "reaction time",
        "modulus for a compression of 4/3 of this time",
        "indentation",
        "peak force",
        "the paper's foam: indentation at the reaction",
        "in the end",
    )
    lines = []
    for one in thinning(FIRST_DESIGN, FIRST_DESIGN.foams[0]):
        assert one.modulus_pa is not None
        assert one.compression_m is not None
        assert one.pressed_m is not None
        assert one.stopped_m is not None
        depths = [f"{1e3 * depth:.3g} mm" for depth in (one.compression_m, one.pressed_m, one.stopped_m)]
        foam = (f"{1e3 * one.latency_s:.3g} ms", f"{1e-6 * one.modulus_pa:,.4g} MPa")
        lines.append(writer.line((*foam, depths[0], f"{one.force_n:.4g} N", *depths[1:])))
    return writer.table(head, lines)


def foam_table() -> writer.Table:
    head, rows = ["foam", "E", "E of the layer", "density", "Y", "pressed up to", "source"], []
    for one in FOAMS:
        density = "" if one.density_kg_m3 is None else f"{one.density_kg_m3:g} kg/m³"
        strength = "" if one.yield_pa is None else f"{1e-3 * one.yield_pa:g} kPa"
        modulus, strain = f"{1e-3 * one.modulus_pa:g} kPa", f"{100 * one.strain:g} %"
        rows.append([one.name, modulus, f"{1e-3 * one.layer_pa:.0f} kPa", density, strength, strain, one.source])
    return writer.Table(head, rows, columns=head[:-1])


def draw(folder: Path) -> list[Path]:
    return [caps.draw(folder / "cover-caps.svg"), *drawing.draw(folder, "svg")]
