"""The command `contactfpga cover felt`."""

from __future__ import annotations

import argparse

from contactfpga.design import kits
from contactfpga.design.cover import felt as touches
from contactfpga.design.cover.answer import CoverError, NoSolution
from contactfpga.design.cover.felt import Felt, Force, Sheet
from contactfpga.design.cover.press import Cover, load_cover
from contactfpga.errors import UNSOLVED
from contactfpga.skin import Skin
from contactfpga.tools.commands import cover
from contactfpga.tools.commands.cover import MM
from contactfpga.tools.console import flags, numbers, results

EXTRA = None

M = 1e-3


def add_flags(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("skin", metavar="SKIN", nargs="?", help="TOML file of a Skin with a table [cover].")
    flags.kit(parser)
    finger = parser.add_argument_group("finger, an ellipse whose size does not depend on its force")
    for name, usual in (("--length", touches.LENGTH_M), ("--width", touches.WIDTH_M)):
        side = f"Its {name.strip('-')} (default: {usual:g})."
        finger.add_argument(name, type=cover.LENGTH, default=usual, metavar="M", help=side)
    places = f"Places of it, spread evenly over the sheet (default: {touches.PLACES})."
    whole = numbers.whole(1, touches.MOST_PLACES)
    finger.add_argument("--places", type=whole, default=touches.PLACES, metavar="N", help=places)
    rest = parser.add_argument_group("what presses though nothing touches")
    link = "The link's own acceleration toward the outside of the sheet (default: 0)."
    rest.add_argument("--acceleration", type=numbers.number(0, 1e4, "m/s2"), default=0.0, metavar="M/S2", help=link)
    density = "Density of the foam, which the acceleration presses on the switches (default: 0)."
    rest.add_argument(
        "--foam-density", type=numbers.number(0, 1e4, "kg/m3"), default=0.0, metavar="KG/M3", help=density
    )
    seed = "Of the closing forces that are drawn where the switch has a spread (default: 0)."
    parser.add_argument("--seed", type=numbers.whole(0, 2**32 - 1), default=0, metavar="N", help=seed)
    flags.json(parser, flags.SI)


def run(args: argparse.Namespace) -> int:
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
    found = touches.feel(
        *(laid, _sheet(skin), args.length, args.width, args.places, args.acceleration, args.foam_density, args.seed)
    )
    unsolved = any(isinstance(force, NoSolution) for force in (found.half, found.most, found.worst))
    answer = {"finger": {"length_m": args.length, "width_m": args.width}} | vars(found)
    results.show(args, answer, lambda: _print(found, laid, args))
    return UNSOLVED if unsolved else 0


def _sheet(skin: Skin) -> Sheet:
    return Sheet(skin.rows, skin.columns, skin.pitch_x_mm * M, skin.pitch_y_mm * M, skin.mask, skin.closed)


def _print(found: Felt, laid: Cover, args: argparse.Namespace) -> None:
    x, y = (MM * place for place in found.worst_m)
    size = f"an ellipse of {MM * args.length:g} x {MM * args.width:g} mm"
    forces = f"{laid.switch.force_n:g} N"
    if found.sheets > 1:
        forces += f", {100 * laid.switch.spread:g} % spread; 95 % of {found.sheets} drawn sheets in parentheses"
    results.table(
        ("finger", f"{size}, at {found.places} places and angles"),
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


def _share(share: float) -> str:
    return f"{100 * share:.3g} %"


def _force(force: Force | NoSolution) -> str:
    if isinstance(force, NoSolution):
        return str(force)
    drawn = f" ({force.low_n:.3g} to {force.high_n:.3g})" if force.low_n != force.high_n else ""
    return f"{force.value_n:.3g} N{drawn}"
