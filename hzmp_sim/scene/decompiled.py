"""A compiled model (.mjb) as an editable one, as far as planning and flying need it.

MuJoCo has no way back. Taken over: bodies, joints, geoms with their meshes and height fields,
sites, numerics, excludes, pairs, and actuators of joints, sites and bodies. The rest (lights,
cameras, textures, sensors, tendons, equalities) moves nothing that is planned for.
"""

from __future__ import annotations

from typing import Any

import mujoco
import numpy as np

from hzmp_planners._arrays import Floats, Ints
from hzmp_planners.errors import SceneError
from hzmp_sim.scene.geoms import mesh_arrays

_TYPE, _OBJECT, _DRIVEN = mujoco.mjtGeom, mujoco.mjtObj, mujoco.mjtTrn

_GEOM = ("size", "contype", "conaffinity", "condim", "priority", "friction", "solref", "solimp",
         "margin", "gap", "group", "rgba")  # fmt: skip
_PAIR = ("condim", "margin", "gap", "solref", "solimp", "friction")
_ACTUATOR = ("gear", "ctrlrange", "ctrllimited", "forcerange", "forcelimited", "dyntype", "dynprm",
             "gaintype", "gainprm", "biastype", "biasprm")  # fmt: skip


def decompiled(model: mujoco.MjModel) -> mujoco.MjSpec:
    """An editable model that compiles to the same bodies, geoms, sites and actuators.

    Raises:
        SceneError: the model has flexes, or parts that touch the body in ways not taken over.
    """
    if model.nflex:
        raise SceneError("a compiled model with flexes cannot be read; give its MJCF file")
    spec = mujoco.MjSpec()
    spec.compiler.degree = False
    for name in dir(model.opt):
        if not name.startswith("_"):
            setattr(spec.option, name, getattr(model.opt, name))
    _add_assets(spec, model)
    bodies = [spec.worldbody]
    for body in range(1, model.nbody):
        parent = bodies[int(model.body_parentid[body])]
        bodies.append(_add_body(parent, model, body))
    for joint in range(model.njnt):
        _add_joint(bodies[int(model.jnt_bodyid[joint])], model, joint)
    for geom in range(model.ngeom):
        _add_geom(bodies[int(model.geom_bodyid[geom])], model, geom)
    for site in range(model.nsite):
        bodies[int(model.site_bodyid[site])].add_site(
            name=model.site(site).name,
            pos=model.site_pos[site],
            quat=model.site_quat[site],
            size=model.site_size[site],
            group=int(model.site_group[site]),
        )
    _add_contacts(spec, model)
    for actuator in range(model.nu):
        _add_actuator(spec, model, actuator)
    for number in range(model.nnumeric):
        start, size = int(model.numeric_adr[number]), int(model.numeric_size[number])
        label = mujoco.mj_id2name(model, int(_OBJECT.mjOBJ_NUMERIC), number)
        spec.add_numeric(name=label, data=model.numeric_data[start : start + size], size=size)
    return spec


def _add_assets(spec: mujoco.MjSpec, model: mujoco.MjModel) -> None:
    for mesh in range(model.nmesh):
        vertices, triangles = file_mesh(model, mesh)
        spec.add_mesh(
            name=_mesh_name(model, mesh),
            uservert=vertices.ravel(),
            userface=triangles.ravel(),
            inertia=mujoco.mjtMeshInertia.mjMESH_INERTIA_SHELL,  # masses are stated anyway
        )
    for field in range(model.nhfield):
        rows, columns = int(model.hfield_nrow[field]), int(model.hfield_ncol[field])
        start = int(model.hfield_adr[field])
        spec.add_hfield(
            name=_field_name(model, field),
            nrow=rows,
            ncol=columns,
            size=model.hfield_size[field],
            userdata=model.hfield_data[start : start + rows * columns],
        )


def file_mesh(model: mujoco.MjModel, mesh: int) -> tuple[Floats, Ints]:
    """Vertices (k, 3) [m] and triangles (m, 3) of a mesh in the frame of its file.

    Compilation centred and turned them.
    """
    turn = np.empty(9)
    mujoco.mju_quat2Mat(turn, model.mesh_quat[mesh])
    vertices, triangles = mesh_arrays(model, mesh)
    return np.asarray(vertices @ turn.reshape(3, 3).T + model.mesh_pos[mesh]), triangles


def _add_body(parent: mujoco.MjsBody, model: mujoco.MjModel, body: int) -> mujoco.MjsBody:
    mass = float(model.body_mass[body])
    return parent.add_body(
        name=model.body(body).name,
        pos=model.body_pos[body],
        quat=model.body_quat[body],
        mocap=int(model.body_mocapid[body]) >= 0,
        gravcomp=float(model.body_gravcomp[body]),
        explicitinertial=mass > 0.0,
        mass=mass,
        ipos=model.body_ipos[body],
        iquat=model.body_iquat[body],
        inertia=model.body_inertia[body],
    )


def _add_joint(body: mujoco.MjsBody, model: mujoco.MjModel, joint: int) -> None:
    kind = mujoco.mjtJoint(int(model.jnt_type[joint]))
    one = kind in (mujoco.mjtJoint.mjJNT_SLIDE, mujoco.mjtJoint.mjJNT_HINGE)
    dof = int(model.jnt_dofadr[joint])
    body.add_joint(
        name=model.joint(joint).name,
        type=kind,
        pos=model.jnt_pos[joint],
        axis=model.jnt_axis[joint],
        range=model.jnt_range[joint],
        limited=int(model.jnt_limited[joint]),
        ref=float(model.qpos0[int(model.jnt_qposadr[joint])]) if one else 0.0,
        damping=model.dof_damping[dof],
        armature=float(model.dof_armature[dof]),
        frictionloss=float(model.dof_frictionloss[dof]),
    )


def _add_geom(body: mujoco.MjsBody, model: mujoco.MjModel, geom: int) -> None:
    kind = _TYPE(int(model.geom_type[geom]))
    position, quat = np.array(model.geom_pos[geom]), np.array(model.geom_quat[geom])
    asset: dict[str, str] = {}
    number = int(model.geom_dataid[geom])
    if kind in (_TYPE.mjGEOM_MESH, _TYPE.mjGEOM_SDF):
        asset["meshname"] = _mesh_name(model, number)
        # The geom's frame is that of the centred mesh: go back to that of the file.
        back, turn, shift = np.empty(4), np.empty(4), np.empty(3)
        mujoco.mju_negQuat(back, model.mesh_quat[number])
        mujoco.mju_mulQuat(turn, quat, back)
        mujoco.mju_rotVecQuat(shift, model.mesh_pos[number], turn)
        position, quat = position - shift, turn
    elif kind == _TYPE.mjGEOM_HFIELD:
        asset["hfieldname"] = _field_name(model, number)
    values = _values(model, "geom", _GEOM, geom)
    body.add_geom(
        name=model.geom(geom).name, type=kind, pos=position, quat=quat, mass=0.0, **asset, **values
    )


def _add_contacts(spec: mujoco.MjSpec, model: mujoco.MjModel) -> None:
    for signature in model.exclude_signature:
        ids = int(signature) >> 16, int(signature) & 0xFFFF
        names = [model.body(body).name for body in ids]
        if not all(names):
            raise SceneError("a compiled model excludes contact of a body without name; name it")
        spec.add_exclude(bodyname1=names[0], bodyname2=names[1])
    for pair in range(model.npair):
        ids = int(model.pair_geom1[pair]), int(model.pair_geom2[pair])
        names = [model.geom(geom).name for geom in ids]
        if not all(names):
            raise SceneError("a compiled model pairs a geom without name; name it")
        values = _values(model, "pair", _PAIR, pair, {"dim": "condim"})
        spec.add_pair(geomname1=names[0], geomname2=names[1], **values)


def _add_actuator(spec: mujoco.MjSpec, model: mujoco.MjModel, actuator: int) -> None:
    kind, target = int(model.actuator_trntype[actuator]), int(model.actuator_trnid[actuator, 0])
    names = {
        int(_DRIVEN.mjTRN_JOINT): lambda: model.joint(target).name,
        int(_DRIVEN.mjTRN_JOINTINPARENT): lambda: model.joint(target).name,
        int(_DRIVEN.mjTRN_SITE): lambda: model.site(target).name,
        int(_DRIVEN.mjTRN_BODY): lambda: model.body(target).name,
    }
    if kind not in names:
        return
    name = names[kind]()
    if not name:
        raise SceneError("a compiled model drives a joint, site or body without name; name it")
    values = _values(model, "actuator", _ACTUATOR, actuator)
    spec.add_actuator(
        name=model.actuator(actuator).name, trntype=_DRIVEN(kind), target=name, **values
    )


def _values(
    model: mujoco.MjModel,
    kind: str,
    names: tuple[str, ...],
    row: int,
    compiled: dict[str, str] | None = None,
) -> dict[str, Any]:
    """Attributes of one element, by the names that they have in an editable model."""
    other = {name: old for old, name in (compiled or {}).items()}
    found = {}
    for name in names:
        value = getattr(model, f"{kind}_{other.get(name, name)}")[row]
        found[name] = value if np.ndim(value) else value.item()
    return found


def _mesh_name(model: mujoco.MjModel, mesh: int) -> str:
    return str(mujoco.mj_id2name(model, int(_OBJECT.mjOBJ_MESH), mesh))


def _field_name(model: mujoco.MjModel, field: int) -> str:
    return str(mujoco.mj_id2name(model, int(_OBJECT.mjOBJ_HFIELD), field))
