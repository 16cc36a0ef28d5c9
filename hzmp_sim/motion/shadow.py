"""The world without the body that flies: what the script and MuJoCo's own dynamics will do."""

from __future__ import annotations

import copy

import mujoco
import numpy as np

from hzmp_planners.errors import SceneError
from hzmp_sim.motion.drives import Drives, driven_joints
from hzmp_sim.scene.bodies import descends
from hzmp_sim.scene.scene import Scene

_NEVER = -1e6  # [m] contact margin of a pair that is never to touch
_BAD = (mujoco.mjtWarning.mjWARN_BADQPOS, mujoco.mjtWarning.mjWARN_BADQVEL,
        mujoco.mjtWarning.mjWARN_BADQACC)  # fmt: skip


class Shadow:
    """A copy of a scene's world, run ahead.

    The flown body touches nothing in it and is held where it starts, so that it is the same
    whatever is flown. Only announced motions are applied.

    Attributes:
        data: at `steps` physics steps, kinematics done.
        steps: how many were taken.
    """

    def __init__(self, scene: Scene) -> None:
        self.model = model = copy.copy(scene.model)
        flown = model.body(scene.body).id
        mine = [g for g in range(model.ngeom) if descends(model, int(model.geom_bodyid[g]), flown)]
        model.geom_contype[mine] = model.geom_conaffinity[mine] = 0
        for geoms in (model.pair_geom1, model.pair_geom2):
            model.pair_margin[np.isin(geoms, mine)] = _NEVER
        first, count = int(model.body_jntadr[flown]), int(model.body_jntnum[flown])
        joints = list(range(first, first + count))
        held = [d for d in range(model.nv) if int(model.dof_jntid[d]) in joints]
        self._dofs = np.array(held, dtype=np.int64)
        last = first + count
        self._qpos = slice(
            int(model.jnt_qposadr[first]),
            int(model.jnt_qposadr[last]) if last < model.njnt else model.nq,
        )
        self._initial = scene.initial_qpos
        self._drives = Drives(model, scene.motion, announced=True)
        steered = {*joints, *driven_joints(model, scene.motion)}
        self._moves_freely = any(int(j) not in steered for j in model.dof_jntid)
        self.data = mujoco.MjData(model)
        self.data.qpos[:] = scene.initial_qpos
        self.steps = 0
        self._settle()

    def advance(self, steps: int) -> None:
        """Some physics steps on."""
        if self._moves_freely:
            for _ in range(steps):
                self._step()
        else:
            self.steps += steps
            self._settle()

    def _step(self) -> None:
        mujoco.mj_step(self.model, self.data)
        if any(self.data.warning[int(kind)].number for kind in _BAD):
            raise SceneError(
                f"the bodies of this world fly apart after {self.data.time:.3g} s without the "
                "flown one: MuJoCo finds no finite state (see its timestep, masses and joints)"
            )
        self.data.qpos[self._qpos] = self._initial[self._qpos]
        self.data.qvel[self._dofs] = 0.0
        self.steps += 1
        self._settle()

    def _settle(self) -> None:
        self._drives.apply(self.data, self.steps * float(self.model.opt.timestep))
        mujoco.mj_kinematics(self.model, self.data)
