"""Which geoms MuJoCo could bring into contact: its own rule, in the order it applies it.

MuJoCo documentation, Computation / Collision detection / Selection. A geom pair is checked when it
is a `<pair>`, or when all of these hold: the bodies are in different weld groups, one of them can
move, they are not parent and child (unless the parent is the world, or the filter is off), the
body pair is not an `<exclude>`, and contype/conaffinity share a bit. Contact force starts at a
distance below the margin: the sum of both geoms' margins, or the pair's own.
"""

from __future__ import annotations

import mujoco
import numpy as np

from hzmp_planners._arrays import Bools, Floats

_NO_CONTACTS = int(mujoco.mjtDisableBit.mjDSBL_CONTACT) | int(
    mujoco.mjtDisableBit.mjDSBL_CONSTRAINT
)


def contact_margins(model: mujoco.MjModel, geoms: tuple[int, ...]) -> Floats:
    """Distance [m] below which MuJoCo makes contact force between each of `geoms` and every geom.

    Returns:
        Shape (len(geoms), ngeom); NaN where MuJoCo never makes contact.
    """
    rows = np.array(geoms, dtype=np.int64)
    margins = np.full((rows.size, model.ngeom), np.nan)
    if model.opt.disableflags & _NO_CONTACTS:
        return margins
    body = np.array(model.geom_bodyid, dtype=np.int64)
    allowed = _bodies_may_touch(model)[body[rows][:, None], body]
    contype, conaffinity = model.geom_contype, model.geom_conaffinity
    allowed &= ((contype[rows][:, None] & conaffinity) | (conaffinity[rows][:, None] & contype)) > 0
    margin = np.array(model.geom_margin)
    total = margin[rows][:, None] + margin
    margins[allowed] = total[allowed]
    for one, two, pair_margin in zip(
        model.pair_geom1, model.pair_geom2, model.pair_margin, strict=True
    ):
        for a, b in ((one, two), (two, one)):
            margins[rows == a, b] = pair_margin
    if model.opt.enableflags & int(mujoco.mjtEnableBit.mjENBL_OVERRIDE):
        margins[~np.isnan(margins)] = model.opt.o_margin
    return margins


def _bodies_may_touch(model: mujoco.MjModel) -> Bools:
    """Symmetric matrix (nbody, nbody) of the body filters."""
    weld = np.array(model.body_weldid, dtype=np.int64)
    parent = weld[np.array(model.body_parentid, dtype=np.int64)[weld]]
    movable = np.array(model.body_dofnum)[weld] > 0
    movable &= weld != 0
    touch = (weld[:, None] != weld) & (movable[:, None] | movable)
    if not model.opt.disableflags & int(mujoco.mjtDisableBit.mjDSBL_FILTERPARENT):
        related = (weld[:, None] == parent) | (parent[:, None] == weld)
        touch &= ~(related & (weld[:, None] != 0) & (weld != 0))
    for signature in model.exclude_signature:
        one, two = int(signature) >> 16, int(signature) & 0xFFFF
        touch[one, two] = touch[two, one] = False
    return np.asarray(touch)
