"""The command `contactfpga cover felt`."""

from __future__ import annotations

import argparse

from contactfpga.design import kits
from contactfpga.design.cover import felt as touches
from contactfpga.design.cover.answer import CoverError, NoSolution
from contactfpga.design.cover.felt import Felt, Force, Sheet
from contactfpga.design.cover.layers import BODIES, Layer
from contactfpga.design.cover.press import Cover, load_cover
from contactfpga.errors import UNSOLVED
from contactfpga.skin import Skin
from contactfpga.tools.commands import cover
from contactfpga.tools.commands.cover import MM
from contactfpga.tools.console import flags, numbers, results

EXTRA = None

M = 1e-3


def add_flags(flag: flags.Flags) -> None:
    flag("[SKIN]", "TOML file of a Skin with a table [cover].")
    flags.kit(flag)
    finger = flag.group("what presses, an ellipse that grows with its force")
    finger("--body NAME", "What it is.", tuple(BODIES), touches.BODY.name)
    finger("--length M", "Its length at the body's depth.", cover.LENGTH, touches.LENGTH_M)
    finger("--width M", "Its width there.", cover.LENGTH, touches.WIDTH_M)
    places = "Places of it, spread evenly over the sheet."
    finger("--places N", places, numbers.whole(1, touches.MOST_PLACES), touches.PLACES)
    rest = flag.group("what presses though nothing touches")
    link = "The link's own acceleration toward the outside of the sheet."
    rest("--acceleration M/S2", link, numbers.number(0, 1e4, "m/s2"), 0.0)
    density = "Density of the foam, which the acceleration presses on the switches."
    rest("--foam-density KG/M3", density, numbers.number(0, 1e4, "kg/m3"), 0.0)
    seed = "Of the closing forces that are drawn where the switch has a spread."
    flag("--seed N", seed, numbers.whole(0, 2**32 - 1), 0)
    flags.json(flag, flags.SI)


def run(args: argparse.Namespace) -> int:
    skin, laid = sheet_and_cover(args)
    found = touches.feel(
        *(laid, _sheet(skin), args.length, args.width, args.places, args.acceleration, args.foam_density, args.seed),
        BODIES[args.body],
    )
    unsolved = any(isinstance(force, NoSolution) for force in (found.half, found.most, found.worst))
    answer = {"finger": {"body": args.body, "length_m": args.length, "width_m": args.width}} | vars(found)
    results.show(args, answer, lambda: _print(found, laid, args))
    return UNSOLVED if unsolved else 0


def sheet_and_cover(args: argparse.Namespace) -> tuple[Skin, Cover]:
    """The Skin of the file or kit, and its cover; raises :class:`CoverError` for one that knows no force."""
    args.skin = flags.sheet_file(args)
    if args.skin is None:
        raise CoverError(f"name a Skin's file, or a kit: --kit {' or --kit '.join(kits.names())}")
    skin, laid = Skin.load(args.skin, trust=args.trust), load_cover(args.skin)
    if laid is None or laid.model == "patch":
        what = "has no table [cover]" if laid is None else "has the model 'patch'"
        raise CoverError(
            f"{args.skin} {what}, so any touch of a switch closes it, whatever its force; "
            "give [cover] with a model that goes by stress, as examples/tiles.toml does"
        )
    return skin, laid


def _sheet(skin: Skin) -> Sheet:
    return Sheet(skin.rows, skin.columns, skin.pitch_x_mm * M, skin.pitch_y_mm * M, skin.mask, skin.closed)


def _print(found: Felt, laid: Cover, args: argparse.Namespace) -> None:
    x, y = (MM * place for place in found.worst_m)
    body = BODIES[args.body]
    size = f"{body.name}, {MM * args.length:g} x {MM * args.width:g} mm at a depth of {MM * body.depth_m:g} mm"
    forces = f"{laid.switch.force_n:g} N"
    if found.sheets > 1:
        forces += f", {100 * laid.switch.spread:g} % spread; 95 % of {found.sheets} drawn sheets in parentheses"
    results.table(
        ("what presses", f"{size}, at {found.places} places and angles"),
        ("its flesh", _layer(body.flesh)),
        ("foam", _layer(Layer(laid.thickness_m, laid.modulus_pa))),
        ("a switch closes at", forces),
        ("50 % of touches felt from", _force(found.half)),
        ("99 % of touches felt from", _force(found.most)),
        ("worst place felt from", f"{_force(found.worst)}, at x {x:.1f} mm, y {y:.1f} mm"),
        (
            "of its force, one switch takes",
            f"{_share(found.median_share)} in the median, {_share(found.least_share)} least",
        ),
        ("false presses, expected", f"{found.false_presses:.2g}" if found.false_presses >= 1e-9 else "0"),
    )


def _layer(layer: Layer | None) -> str:
    return "rigid" if layer is None else f"{MM * layer.thickness_m:g} mm, {1e-3 * layer.modulus_pa:.3g} kPa at first"


def _share(share: float) -> str:
    return f"{100 * share:.3g} %"


def _force(force: Force | NoSolution) -> str:
    if isinstance(force, NoSolution):
        return str(force)
    drawn = f" ({force.low_n:.3g} to {force.high_n:.3g})" if force.low_n != force.high_n else ""
    return f"{force.value_n:.3g} N{drawn}"
