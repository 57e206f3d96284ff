"""What the tests of `contactfpga fit` share: scenes, and formulas in the place of synthesis."""

import math
import random
from concurrent.futures import ThreadPoolExecutor

from contactfpga.skin import Skin
from contactfpga_sim.apps.fit import sources
from contactfpga_sim.apps.fit.candidates import candidates, pitches_for, size_for
from contactfpga_sim.apps.fit.search import fit
from contactfpga_sim.apps.fit.sources import source
from contactfpga_sim.apps.fit.trial import FitTask, Goals
from contactfpga_sim.apps.speed import Speed

BUMPER = 'width_mm = 80\nheight_mm = 80\ncount = 100\n[[contact]]\nshape = "disc"\nradius_mm = [12, 18]\n'
SECOND = '[[contact]]\nshape = "disc"\nradius_mm = 12\n'
APART = "gap_mm = 16\n"
HANDS = APART + BUMPER.replace("[12, 18]", "12") + "number = [2, 3]\n"


class Shortcuts:
    """What was asked of them."""

    def __init__(self):
        self.sized = []
        self.checked = []

    def luts_of(self, skin):
        self.sized.append(skin)
        return 400 + skin.rows + skin.columns

    def measure(self, skin, frames, checked):
        self.checked.append((skin, checked))
        size = 12 + skin.rows * math.ceil(skin.columns / 8) if skin.report == "cells" else 17
        scan = 6.0 * skin.rows
        return Speed(1.5 * scan + 10 * size / 3, 2 * scan + 10 * size / 3, scan, size, scan, 1e6 / scan)


def chosen(*names, pitches=(10.0, 20.0), shuffled=None, tried=None, **limits):
    """The fit on these scenes, and the candidates in the order of ``shuffled``."""
    given = tuple(map(source, names))
    options = {name: limits.pop(name) for name in ("host_us", "base") if name in limits}
    count = limits.pop("count", None) or sources.default_count(given)
    base = options.pop("base", None)
    if tried is None:
        tried = candidates(base or Skin(), pitches_for(base, given, pitches), size_for(base, given))
    if shuffled is not None:
        random.Random(shuffled).shuffle(tried)
    task = FitTask(given, names, base or Skin(), Goals(**limits), count, timed=6, **options)
    with ThreadPoolExecutor(1) as executor:
        return fit(task, tried, executor)
