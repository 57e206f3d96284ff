"""The chart's pictures, drawn from its numbers: ``python -m contactfpga_sim.lab.chart.page_pictures``.

Nothing is measured: `docs/chart/chart.csv` gives `docs/chart/chart.svg` and the README's `docs/images/front.svg`.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from contactfpga.tools.console import interrupt
from contactfpga_sim.lab.chart import front_picture, numbers, picture

NUMBERS = Path("docs/chart/chart.csv")
FRONT = Path("docs/images/front.svg")


def main() -> int:
    """Draw both in the folder of the sources."""
    argparse.ArgumentParser(
        description="Draw the pictures of docs/chart.md and README.md from their numbers."
    ).parse_args()
    points = numbers.read(NUMBERS)
    picture.save(points, NUMBERS.parent)
    front_picture.save(points, FRONT)
    print(f"drew {NUMBERS.parent / 'chart.svg'}\ndrew {FRONT}")
    return 0


if __name__ == "__main__":
    sys.exit(interrupt.guarded(main))
