"""Bodies on layers against finite elements, closed forms and published fingertips."""

import collections
import functools
import math

import numpy as np
import pytest
from scipy.special import j0

from contactfpga.design.cover import medium
from contactfpga.design.cover.layers import Indentation, Layer, Spring
from contactfpga.design.cover.patch import Ellipse, Rectangle
from contactfpga_sim.lab.cover import formulas
from contactfpga_sim.lab.cover.elements import Block, touching

PITCH, TILE, FOAM, MODULUS = 6.4, 5.8, 2.0, 0.345
"""Pitch, width and thickness of tiles in mm, and the modulus of their foam in MPa."""


def foam(thickness=FOAM, carries=1.0):
    return Layer(1e-3 * thickness, 1e6 * MODULUS * carries, coupled=True)


TILES = foam(carries=(TILE / PITCH) ** 2)


def ball(radius, *layers):
    """A body of revolution with this radius of curvature in mm."""
    half = 1e-3 * math.sqrt(2 * radius)
    return Indentation([Ellipse(half, half)], 1e-3, layers)


# ---- a rigid body


@pytest.mark.parametrize("poisson", [0, 0.1, 0.25])
@pytest.mark.parametrize(("radius", "bricks"), [(38, 8), (8, 10)])
def test_tiles_under_a_rigid_body(radius, bricks, poisson):
    """Forces at 10 and 30 % strain: their mean over places within 10 %, and each if the body touches many tiles."""
    side = np.linspace(-TILE / 2, TILE / 2, bricks + 1)
    block = Block(side, side, np.linspace(0, FOAM, 5), poisson)
    for depth in (0.2, 0.6):
        places, found = [(x, y) for x in (0.8, 2.4) for y in (0.8, 2.4)], []
        for x, y in places[:2] + places[3:]:
            away = PITCH * np.arange(-3, 4)
            tiles = collections.Counter(tuple(sorted((abs(x + a), abs(y + b)))) for a in away for b in away)
            gaps = {at: depth - np.hypot(block.top_x + at[0], block.top_y + at[1]) ** 2 / 2 / radius for at in tiles}
            touched = {at: gap for at, gap in gaps.items() if gap.max() > 0}
            found.append(sum(tiles[at] * block.pressed(MODULUS, gap).sum() for at, gap in touched.items()))
        ours = ball(radius, TILES).force_n(1e-3 * depth)
        assert ours == pytest.approx(np.dot([0.25, 0.5, 0.25], found), rel=0.1), depth
        if (radius, depth) == (38, 0.6):
            assert ours == pytest.approx(np.array(found), rel=0.1)


@pytest.mark.parametrize("poisson", [0, 0.1, 0.2])
@pytest.mark.parametrize("radius", [8, 38])
@pytest.mark.parametrize("thickness", [2, 5])
def test_whole_foam_under_a_rigid_body(thickness, radius, poisson):
    for depth in (0.1 * thickness, 0.3 * thickness):
        reach = 1.15 * math.sqrt(2 * radius * depth)
        beyond = reach + 2.5 * thickness * np.array([0.2, 0.55, 1.0])
        planes = np.append(np.linspace(0, reach, 8), beyond)
        block = Block(planes, planes, np.linspace(0, thickness, 5), poisson, (True, True))
        found = 4 * block.pressed(MODULUS, depth - (block.top_x**2 + block.top_y**2) / 2 / radius).sum()
        assert ball(radius, foam(thickness)).force_n(1e-3 * depth) == pytest.approx(found, rel=0.1), depth


@pytest.mark.parametrize(
    ("transfer", "poisson"), [(functools.partial(medium.transfer, "bonded"), 0.4999), (medium.foam, medium.POISSON)]
)
def test_spread_of_a_force_to_the_base(transfer, poisson):
    """Shares of a point force on squares of the base that are two and three thicknesses wide."""
    planes = np.append(np.linspace(0, 1.5, 10), [2, 2.8, 4])
    block = Block(planes, planes, np.linspace(0, 1, 7), poisson, (True, True))
    carried = block.carried(0).reshape(len(planes), -1)
    waves, away = (np.arange(600) + 0.5) / 20, np.linspace(0, 3, 301)
    stress = j0(np.outer(away, waves)) @ (waves * transfer(waves)) / 40 / math.pi
    for last in (6, 9):
        halved = np.append(np.ones(last), 0.5)
        places = (np.arange(64) + 0.5) / 64 * planes[last]
        ours = 4 * planes[last] ** 2 * np.interp(np.hypot(places[:, None], places), away, stress).mean()
        assert ours == pytest.approx(halved @ carried[: last + 1, : last + 1] @ halved, abs=0.01)


# ---- a soft body


def planes_of(middles):
    """Planes of flesh on tiles at these middles, and beyond them."""
    tiles = [np.linspace(max(0, at - TILE / 2), at + TILE / 2, 7 if at else 4) for at in middles]
    return tiles, np.unique(np.concatenate([[0], *tiles, tiles[-1][-1] + np.array([1.5, 4, 8])]))


@pytest.mark.parametrize(("modulus", "poisson", "thickness"), [(0.05, 0.45, 8), (0.05, 0.3, 6), (0.1, 0.45, 5)])
def test_tiles_under_a_soft_body(modulus, poisson, thickness):
    """Flesh on a round core, known to the model by force and area on a hard plate only: the force within 10 %, and the
    part of it on a tile under the middle within 6 %."""
    depths, core = np.array([0.5, 1, 1.5, 2, 2.5]), 8.0
    flesh = None
    for middles in ((0, 0), (0, 0.5), (0.5, 0.5)):
        (tiles_x, x), (tiles_y, y) = (planes_of([PITCH * middle, PITCH * (middle + 1)]) for middle in middles)
        block = Block(x, y, np.linspace(0, thickness, 6), poisson, (True, True))
        height = (block.top_x**2 + block.top_y**2) / 2 / core
        near = np.flatnonzero(
            np.isin(block.top_x, np.concatenate(tiles_x)) & np.isin(block.top_y, np.concatenate(tiles_y))
        )
        compliance = block.moved(modulus, near)[block.top[near], 2]
        if flesh is None:
            widths = [(np.diff(side, prepend=side[0]) + np.diff(side, append=side[-1])) / 2 for side in (x, y)]
            forces = [touching(compliance, depth - height[near]) for depth in depths]
            areas = [4 * np.outer(*widths).ravel()[near][force > 0].sum() for force in forces]
            flesh, radius = on_a_plate(depths, np.array([4 * force.sum() for force in forces]), areas)
        for tile_x in tiles_x:
            for tile_y in tiles_y:
                mirrored = tile_x[0] == 0, tile_y[0] == 0
                tile = Block(tile_x, tile_y, np.linspace(0, FOAM, 5), 0.2, mirrored)
                on_x, on_y = np.isin(block.top_x[near], tile_x), np.isin(block.top_y[near], tile_y)
                on = np.flatnonzero(on_x & on_y)
                compliance[np.ix_(on, on)] += tile.moved(MODULUS)[tile.top, 2]
        forces = np.array([touching(compliance, depth - height[near]) for depth in depths])
        indentation, cell = ball(radius, flesh, TILES), 1e-3 * PITCH * (np.arange(200) - 99.5) / 200
        assert [indentation.force_n(1e-3 * depth) for depth in depths] == pytest.approx(4 * forces.sum(axis=1), rel=0.1)
        if middles == (0, 0):
            pads = [indentation.parts_at(1e-3 * depth)[0] for depth in depths]
            ours = [pad.density(cell[:, None], cell).mean() * 1e-6 * PITCH**2 for pad in pads]
            under = np.maximum(block.top_x, block.top_y)[near] <= TILE / 2
            assert ours == pytest.approx(forces[:, under].sum(axis=1) / forces.sum(axis=1), rel=0.06)


def on_a_plate(depths, forces, areas):
    """Layer with these forces in N and areas in mm2 on a hard plate, and its radius of curvature in mm."""
    radius = np.dot(areas, depths) / np.dot(depths, depths) / 2 / math.pi
    power, factor = np.polyfit(np.log(depths), np.log(forces), 1)

    class Flesh(Layer):
        def pressed_m(self, pressure_pa):
            slope = 2e-6 * math.pi * radius * pressure_pa
            return 1e-3 * (slope / power / math.exp(factor)) ** (1 / (power - 1))

    return Flesh(1.0, 1e5), radius


# ---- closed forms


@pytest.mark.parametrize(
    "layers",
    [[Layer(6e-3, 5e4)], [Layer(6e-3, 5e4), Layer(2e-3, 3e5)], [Layer(6e-3, 5e4), Spring(2e8, 2e-4), Layer(2e-3, 3e5)]],
)
def test_layers_in_series(layers):
    """To 95 % strain of the first: F = A/D sum E t (-x - ln(1 - x)) of layers at the strains x, and A p of a flat."""
    round_part, flat = Ellipse(6e-3, 5e-3), Rectangle(4e-3, 3e-3)
    indentation = Indentation([round_part, flat], 3e-3, layers)
    for pressure in 5e4 / (1 / np.array([0.01, 0.1, 0.3, 0.6, 0.95]) - 1):
        depth = integral = 0.0
        for layer in layers:
            if isinstance(layer, Spring):
                travel = min(pressure / 2e8, 2e-4)
                depth, integral = depth + travel, integral + 1e8 * travel**2
            else:
                strain = pressure / (layer.modulus_pa + pressure)
                depth += layer.thickness_m * strain
                integral -= layer.modulus_pa * layer.thickness_m * (strain + math.log(1 - strain))
        force = math.pi * 6e-3 * 5e-3 / 3e-3 * integral + 48e-6 * pressure
        assert indentation.force_n(depth) == pytest.approx(force, rel=2e-3)
        assert indentation.depth_m(force) == pytest.approx(depth, rel=2e-3)
        pad, unchanged = indentation.parts_at(depth)
        assert unchanged == flat
        assert pad.density(0, 0) * (force - 48e-6 * pressure) == pytest.approx(pressure, rel=0.02)
        assert pad.area_m2 == pytest.approx(round_part.area_m2 * depth / 3e-3, rel=1e-6)


# ---- published fingertips


def test_published_fingertips():
    """What abstracts and a caption say of fingers on hard plates (sources: docs/cover.md); none of it has set the
    model's finger."""
    tip = formulas.fingertip()
    assert min(tip.exponential, tip.secant) > 0.99
    assert tip.paraboloid < 0.18
    assert 0.35 < tip.power < 0.5  # a finger that stiffens more than Hertz's, whose power is 2/3
