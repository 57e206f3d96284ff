"""Finite elements of soft blocks on rigid bases: an oracle of the cover's layers that shares no code with them.

Lengths are in mm, forces in N and moduli in MPa. Strains are small ones.
"""

import itertools

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import splu

CORNERS = np.array([corner[::-1] for corner in itertools.product((-1, 1), repeat=3)])
"""Corners of a brick in units of its half edges, x first."""


def _slopes(point):
    """(8, 3) slopes of a brick's shape functions at a point, in units of its half edges."""
    factors = 1 + CORNERS * point
    others = factors[:, [1, 2, 0]] * factors[:, [2, 0, 1]]
    return CORNERS * others / 8


def bricks(edges, poisson):
    """(n, 24, 24) stiffness of bricks of 1 MPa with (n, 3) edges.

    Their volume changes as it does at their middle (B-bar), so that nearly incompressible flesh does not lock.
    """
    lame, shear = poisson / (1 + poisson) / (1 - 2 * poisson), 1 / (2 + 2 * poisson)
    elastic = np.diag([2, 2, 2, 1, 1, 1]) * shear
    elastic[:3, :3] += lame
    half = edges[:, None] / 2
    middle, found = _slopes(np.zeros(3)) / half, 0
    for point in CORNERS / np.sqrt(3):
        slopes = _slopes(point) / half
        strain = np.zeros((len(edges), 6, 8, 3))
        for axis in range(3):
            one, two = (axis + 1) % 3, (axis + 2) % 3
            strain[:, axis, :, axis] = slopes[..., axis]
            strain[:, 3 + axis, :, one], strain[:, 3 + axis, :, two] = slopes[..., two], slopes[..., one]
        strain[:, :3] += (middle - slopes)[:, None] / 3
        flat = strain.reshape(-1, 6, 24)
        found = found + flat.transpose(0, 2, 1) @ elastic @ flat
    return found * edges.prod(axis=1)[:, None, None] / 8


def solved(stiffness, loads):
    """Displacements under loads."""
    return splu(sparse.csc_array(stiffness), permc_spec="MMD_AT_PLUS_A", options={"SymmetricMode": True}).solve(loads)


class Block:
    """A block bonded to a rigid base, free at its sides and without friction on top.

    ``x``, ``y``, ``z``: the planes of its nodes; z runs from the base up. ``mirrored``: whether the first plane of x
    and that of y are planes of symmetry, so that it is a half or a quarter of a block. ``held``: which nodes of the
    bottom are on the base.
    """

    def __init__(self, x, y, z, poisson, mirrored=(False, False), held=slice(None)):
        index = np.arange(len(x) * len(y) * len(z)).reshape(len(x), len(y), len(z))
        self.base, self.top = index[..., 0].ravel(), index[..., -1].ravel()
        self.top_x, self.top_y = (plane.ravel() for plane in np.meshgrid(x, y, indexing="ij"))
        lower, upper = slice(None, -1), slice(1, None)
        self._nodes = np.stack(
            [index[tuple(upper if side > 0 else lower for side in corner)].ravel() for corner in CORNERS], axis=1
        )
        edges = np.meshgrid(np.diff(x), np.diff(y), np.diff(z), indexing="ij")
        self._edges = np.stack([edge.ravel() for edge in edges], axis=1)
        self._bricks = bricks(self._edges, poisson)
        free = np.ones((index.size, 3), bool)
        free[self.base[held]] = False
        free[index[0] if mirrored[0] else [], 0] = False
        free[index[:, 0] if mirrored[1] else [], 1] = False
        self._free = np.flatnonzero(free)

    def _stiffness(self, moduli):
        places = (3 * self._nodes[:, :, None] + np.arange(3)).reshape(-1, 24)
        rows, columns = np.repeat(places, 24, axis=1), np.tile(places, 24)
        values = self._bricks * np.broadcast_to(moduli, len(places))[:, None, None]
        size = places.max() + 1
        return sparse.csc_array((values.ravel(), (rows.ravel(), columns.ravel())), shape=(size, size))

    def moved(self, moduli, at=slice(None)):
        """(nodes, 3, n) displacement under 1 N on each of n nodes ``at`` of the top; force and z point down."""
        stiffness = self._stiffness(moduli)[self._free][:, self._free]
        loaded = np.searchsorted(self._free, 3 * self.top[at] + 2)
        loads = np.zeros((len(self._free), len(loaded)))
        loads[loaded, np.arange(len(loaded))] = 1
        found = np.zeros((3 * (self._nodes.max() + 1), len(loaded)))
        found[self._free] = solved(stiffness, loads)
        return found.reshape(-1, 3, len(loaded))

    def pressed(self, modulus, gap):
        """Forces on the nodes of the top, which a rigid body presses in by at least (n,) ``gap``.

        Each brick has the secant modulus E/(1 - e) at its mean vertical strain e.
        """
        near, strain, last = np.flatnonzero(gap > -gap.max() / 4), 0.0, 0.0
        for _ in range(30):
            moved = self.moved(modulus / (1 - strain), near)
            force = touching(moved[self.top[near], 2], gap[near])
            if abs(force.sum() - last) < 2e-3 * last:
                return np.bincount(near, force, len(gap))
            last = force.sum()
            strain = (moved[:, 2] @ force)[self._nodes] @ CORNERS[:, 2] / 4 / self._edges[:, 2]
        raise AssertionError("the moduli do not settle")

    def carried(self, at):
        """Forces on the nodes of the base under 1 N on node ``at`` of the top."""
        moved = self.moved(1.0, [at])
        return -(self._stiffness(1.0) @ moved.ravel()).reshape(-1, 3)[self.base, 2]

    def on_plates(self, modulus, plates, stiffness, load):
        """(plates,) forces on rigid plates that carry the bottom and move up and down alone, each on a spring of
        ``stiffness`` in N/mm, under the forces ``load`` on the nodes of the top.

        ``plates``: the plate of each node of the bottom, -1 for none.
        """
        on, count = np.flatnonzero(plates >= 0), len(self._free)
        places = np.append(self._free, 3 * self.base[on] + 2), np.append(np.arange(count), count + plates[on])
        loads = np.zeros(3 * (self._nodes.max() + 1))
        loads[3 * self.top + 2] = load
        tied = sparse.csc_array((np.ones(count + len(on)), places), shape=(len(loads), count + len(stiffness)))
        springs = sparse.diags_array(np.append(np.zeros(count), stiffness))
        moved = solved(tied.T @ self._stiffness(modulus) @ tied + springs, tied.T @ loads)
        return moved[count:] * stiffness


def touching(compliance, gap):
    """(n,) forces of at least 0 that press nodes in by (n,) ``gap`` or, where they are 0, by more."""
    touch = gap > 0
    for _ in range(100):
        force = np.zeros(len(gap))
        force[touch] = np.linalg.solve(compliance[np.ix_(touch, touch)], gap[touch])
        now = np.where(touch, force > 0, compliance @ force < gap - 1e-12)
        if (now == touch).all():
            return force
        touch = now
    raise AssertionError("the contact does not settle")
