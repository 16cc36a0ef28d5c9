# Just the calls used. Array shapes in comments; n* are counts of the model.
# The enums are pybind11's, which behave as IntEnum in what is used: int(), ==, hash, index, name.
import enum
from collections.abc import Callable, Iterator, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

__version__: str

_Bytes = NDArray[np.uint8]
_Floats = NDArray[np.float64]
_Ints = NDArray[np.int32]

class FatalError(Exception): ...

class MjContact:
    dist: float
    exclude: int
    flex: _Ints  # (2,)
    frame: _Floats  # (9,)
    geom: _Ints  # (2,), -1 where the side is not a geom
    includemargin: float
    pos: _Floats  # (3,)

class MjData:
    act: _Floats  # (na,)
    cam_xpos: _Floats  # (ncam, 3)
    contact: _MjContactList
    ctrl: _Floats  # (nu,)
    energy: _Floats  # (2,) potential, kinetic [J]
    geom_xmat: _Floats  # (ngeom, 9)
    geom_xpos: _Floats  # (ngeom, 3)
    mocap_pos: _Floats  # (nmocap, 3)
    mocap_quat: _Floats  # (nmocap, 4)
    ncon: int
    qfrc_actuator: _Floats  # (nv,)
    qfrc_applied: _Floats  # (nv,)
    qfrc_bias: _Floats  # (nv,)
    qfrc_gravcomp: _Floats  # (nv,)
    qfrc_passive: _Floats  # (nv,)
    qpos: _Floats  # (nq,)
    qvel: _Floats  # (nv,)
    site_xmat: _Floats  # (nsite, 9)
    site_xpos: _Floats  # (nsite, 3)
    time: float
    warning: Sequence[_MjWarningStat]  # indexed by mjtWarning
    xaxis: _Floats  # (njnt, 3)
    xmat: _Floats  # (nbody, 9)
    xpos: _Floats  # (nbody, 3)
    xquat: _Floats  # (nbody, 4)
    def __init__(self, m: MjModel) -> None: ...

class MjModel:
    actuator_actadr: _Ints
    actuator_biasprm: _Floats
    actuator_biastype: _Ints
    actuator_ctrllimited: _Bytes  # (nu,)
    actuator_damping: _Floats  # (nu,)
    actuator_delay: _Floats  # (nu,) [s]
    actuator_ctrlrange: _Floats  # (nu, 2)
    actuator_dynprm: _Floats
    actuator_dyntype: _Ints
    actuator_forcelimited: _Bytes
    actuator_forcerange: _Floats
    actuator_gainprm: _Floats
    actuator_gaintype: _Ints
    actuator_gear: _Floats  # (nu, 6)
    actuator_trnid: _Ints  # (nu, 2)
    actuator_trntype: _Ints
    body_dofnum: _Ints
    body_gravcomp: _Floats
    body_inertia: _Floats  # (nbody, 3)
    body_ipos: _Floats  # (nbody, 3)
    body_iquat: _Floats  # (nbody, 4)
    body_jntadr: _Ints
    body_jntnum: _Ints
    body_mass: _Floats
    body_mocapid: _Ints
    body_parentid: _Ints
    body_pos: _Floats  # (nbody, 3)
    body_quat: _Floats  # (nbody, 4)
    body_weldid: _Ints
    dof_armature: _Floats  # (nv,)
    dof_bodyid: _Ints
    dof_damping: _Floats  # (nv,)
    dof_frictionloss: _Floats  # (nv,)
    dof_jntid: _Ints
    exclude_signature: _Ints
    flex_conaffinity: _Ints
    flex_contype: _Ints
    geom_bodyid: _Ints
    geom_conaffinity: _Ints
    geom_contype: _Ints
    geom_dataid: _Ints
    geom_group: _Ints
    geom_margin: _Floats
    geom_matid: _Ints
    geom_pos: _Floats  # (ngeom, 3)
    geom_quat: _Floats  # (ngeom, 4)
    geom_rbound: _Floats
    geom_rgba: NDArray[np.float32]  # (ngeom, 4)
    geom_size: _Floats  # (ngeom, 3)
    geom_type: _Ints
    hfield_adr: _Ints
    hfield_data: NDArray[np.float32]  # (nhfielddata,)
    hfield_ncol: _Ints
    hfield_nrow: _Ints
    hfield_size: _Floats  # (nhfield, 4)
    jnt_actfrclimited: _Bytes
    jnt_actfrcrange: _Floats  # (njnt, 2)
    jnt_actgravcomp: _Bytes
    jnt_axis: _Floats  # (njnt, 3)
    jnt_bodyid: _Ints
    jnt_dofadr: _Ints
    jnt_limited: _Ints
    jnt_pos: _Floats  # (njnt, 3)
    jnt_qposadr: _Ints
    jnt_range: _Floats  # (njnt, 2)
    jnt_stiffness: _Floats  # (njnt,)
    jnt_type: _Ints
    key_ctrl: _Floats  # (nkey, nu)
    key_mpos: _Floats  # (nkey, 3 nmocap)
    key_mquat: _Floats  # (nkey, 4 nmocap)
    key_qpos: _Floats  # (nkey, nq)
    key_time: _Floats  # (nkey,)
    mat_rgba: NDArray[np.float32]  # (nmat, 4)
    mesh_face: _Ints  # (nmeshface, 3)
    mesh_faceadr: _Ints
    mesh_facenum: _Ints
    mesh_graph: _Ints
    mesh_graphadr: _Ints
    mesh_pos: _Floats  # (nmesh, 3)
    mesh_quat: _Floats  # (nmesh, 4)
    mesh_texcoordadr: _Ints  # -1: none
    mesh_vert: NDArray[np.float32]  # (nmeshvert, 3)
    mesh_vertadr: _Ints
    mesh_vertnum: _Ints
    nbody: int
    nflex: int
    ngeom: int
    nhfield: int
    njnt: int
    nkey: int
    nmocap: int
    nlight: int
    nmesh: int
    nnumeric: int
    npair: int
    nq: int
    nsite: int
    nu: int
    numeric_adr: _Ints
    numeric_data: _Floats
    numeric_size: _Ints
    nv: int
    opt: MjOption
    pair_geom1: _Ints
    pair_geom2: _Ints
    pair_dim: _Ints  # (npair,)
    pair_margin: _Floats
    qpos0: _Floats  # (nq,)
    site_bodyid: _Ints
    site_group: _Ints
    site_matid: _Ints
    site_pos: _Floats  # (nsite, 3)
    site_quat: _Floats  # (nsite, 4)
    site_rgba: NDArray[np.float32]  # (nsite, 4)
    site_size: _Floats  # (nsite, 3)
    stat: MjStatistic
    tendon_adr: _Ints
    tendon_num: _Ints
    vis: MjVisual
    wrap_objid: _Ints
    wrap_type: _Ints
    @staticmethod
    def from_xml_path(filename: str) -> MjModel: ...
    @staticmethod
    def from_binary_path(filename: str) -> MjModel: ...
    @staticmethod
    def from_xml_string(xml: str, assets: dict[str, bytes] | None = None) -> MjModel: ...
    def actuator(self, key: int | str) -> _Named: ...
    def body(self, key: int | str) -> _Named: ...
    def geom(self, key: int | str) -> _Named: ...
    def joint(self, key: int | str) -> _Named: ...
    def key(self, key: int | str) -> _Named: ...
    def hfield(self, key: int | str) -> _Named: ...
    def site(self, key: int | str) -> _Named: ...

class MjOption:
    density: float
    disableflags: int
    enableflags: int
    gravity: _Floats  # (3,)
    integrator: int
    jacobian: int
    o_margin: float
    timestep: float
    viscosity: float
    wind: _Floats  # (3,)

class MjSpec:
    assets: dict[str, bytes]
    actuators: Sequence[MjsActuator]
    bodies: Sequence[MjsBody]
    compiler: MjsCompiler
    equalities: Sequence[object]
    excludes: Sequence[MjsExclude]
    geoms: Sequence[MjsGeom]
    hfields: Sequence[MjsHField]
    joints: Sequence[MjsJoint]
    keys: Sequence[object]
    materials: Sequence[MjsMaterial]
    meshdir: str
    meshes: Sequence[MjsMesh]
    modelfiledir: str
    modelname: str
    option: MjOption
    pairs: Sequence[MjsPair]
    sensors: Sequence[object]
    sites: Sequence[MjsSite]
    stat: MjStatistic
    tendons: Sequence[object]
    texturedir: str
    textures: Sequence[MjsTexture]
    visual: MjVisual
    worldbody: MjsBody
    def __init__(self) -> None: ...
    @staticmethod
    def from_file(filename: str, assets: dict[str, bytes] | None = None) -> MjSpec: ...
    @staticmethod
    def from_string(xml: str, assets: dict[str, bytes] | None = None) -> MjSpec: ...
    def add_actuator(self, **attributes: Any) -> MjsActuator: ...
    def add_exclude(self, **attributes: Any) -> MjsExclude: ...
    def add_hfield(self, **attributes: Any) -> MjsHField: ...
    def add_mesh(self, **attributes: Any) -> MjsMesh: ...
    def add_numeric(self, **attributes: Any) -> MjsNumeric: ...
    def add_pair(self, **attributes: Any) -> MjsPair: ...
    def attach(
        self,
        child: MjSpec,
        prefix: str | None = None,
        suffix: str | None = None,
        site: MjsSite | str | None = None,
        frame: MjsFrame | str | None = None,
    ) -> MjsFrame: ...
    def body(self, name: str) -> MjsBody | None: ...
    def compile(self) -> MjModel: ...
    def copy(self) -> MjSpec: ...
    def delete(self, element: object) -> None: ...
    def geom(self, name: str) -> MjsGeom | None: ...
    def numeric(self, name: str) -> MjsNumeric | None: ...
    def site(self, name: str) -> MjsSite | None: ...
    def to_xml(self) -> str: ...

class MjStatistic:
    center: _Floats  # (3,)
    extent: float

class MjVisual:
    global_: _MjVisualGlobal
    headlight: _MjVisualHeadlight
    map: _MjVisualMap
    quality: _MjVisualQuality

class MjsActuator:
    name: str
    target: str
    trntype: mjtTrn

class MjsBody:
    bodies: Sequence[MjsBody]
    geoms: Sequence[MjsGeom]
    joints: Sequence[MjsJoint]
    mocap: bool
    name: str
    parent: MjsBody
    pos: _Floats  # (3,)
    quat: _Floats  # (4,)
    sites: Sequence[MjsSite]
    def add_body(self, **attributes: Any) -> MjsBody: ...
    def add_frame(self, **attributes: Any) -> MjsFrame: ...
    def add_geom(self, **attributes: Any) -> MjsGeom: ...
    def add_joint(self, **attributes: Any) -> MjsJoint: ...
    def add_site(self, **attributes: Any) -> MjsSite: ...

class MjsCompiler:
    degree: bool

class MjsExclude:
    name: str

class MjsFrame:
    name: str
    pos: _Floats  # (3,)
    quat: _Floats  # (4,)
    def attach_body(self, body: MjsBody, prefix: str = "", suffix: str = "") -> MjsBody: ...

class MjsGeom:
    alt: MjsOrientation
    conaffinity: int
    contype: int
    gap: float
    group: int
    id: int  # in the compiled model; -1 before
    margin: float
    material: str
    meshname: str
    name: str
    parent: MjsBody
    pos: _Floats  # (3,)
    quat: _Floats  # (4,)
    rgba: NDArray[np.float32]  # (4,)
    size: _Floats  # (3,)
    type: mjtGeom

class MjsHField:
    content_type: str
    file: str
    name: str
    ncol: int
    nrow: int
    userdata: ArrayLike  # (nrow ncol,)

class MjsJoint:
    axis: _Floats  # (3,)
    name: str
    parent: MjsBody
    pos: _Floats  # (3,)
    type: mjtJoint

class MjsMaterial:
    name: str
    rgba: NDArray[np.float32]  # (4,)

class MjsMesh:
    content_type: str
    file: str
    name: str
    refpos: ArrayLike  # (3,)
    refquat: ArrayLike  # (4,)
    scale: ArrayLike  # (3,)
    userface: ArrayLike  # (3 f,)
    uservert: ArrayLike  # (3 k,)

class MjsNumeric:
    data: _Floats
    name: str
    size: int

class MjsOrientation:
    type: mjtOrientation

class MjsPair:
    geomname1: str
    geomname2: str

class MjsSite:
    name: str
    parent: MjsBody
    pos: _Floats  # (3,)
    quat: _Floats  # (4,)
    def attach_body(self, body: MjsBody, prefix: str = "", suffix: str = "") -> MjsBody: ...

class MjsTexture:
    builtin: mjtBuiltin
    content_type: str
    cubefiles: Sequence[str]
    file: str
    height: int
    rgb1: ArrayLike  # (3,)
    type: mjtTexture
    width: int

class MjrContext:
    def __init__(self, model: MjModel, fontscale: int) -> None: ...
    def free(self) -> None: ...

class MjrRect:
    def __init__(self, left: int, bottom: int, width: int, height: int) -> None: ...

class MjvCamera:
    azimuth: float
    distance: float
    elevation: float
    fixedcamid: int
    lookat: _Floats  # (3,)
    type: int
    def __init__(self) -> None: ...

class MjvGeom:
    category: int
    emission: float
    label: str
    pos: NDArray[np.float32]  # (3,)
    rgba: NDArray[np.float32]  # (4,)
    size: NDArray[np.float32]  # (3,)
    type: int

class MjvOption:
    flags: _Bytes  # indexed by mjtVisFlag
    def __init__(self) -> None: ...

class MjvScene:
    flags: _Bytes  # indexed by mjtRndFlag
    geoms: Sequence[MjvGeom]
    ngeom: int
    def __init__(self, model: MjModel, maxgeom: int) -> None: ...

class _MjContactList:
    dist: _Floats  # (ncon,)
    exclude: _Ints
    geom: _Ints  # (ncon, 2)
    def __getitem__(self, key: int) -> MjContact: ...
    def __iter__(self) -> Iterator[MjContact]: ...
    def __len__(self) -> int: ...

class _MjVisualGlobal:
    azimuth: float
    elevation: float
    fovy: float
    offheight: int
    offwidth: int

class _MjVisualHeadlight:
    ambient: NDArray[np.float32]  # (3,)
    diffuse: NDArray[np.float32]  # (3,)

class _MjVisualMap: ...

class _MjVisualQuality:
    numslices: int
    numstacks: int
    offsamples: int
    shadowsize: int

class _MjWarningStat:
    number: int

class _Named:
    id: int
    name: str

def get_mju_user_warning() -> Callable[[str], object] | None: ...
def mj_forward(m: MjModel, d: MjData) -> None: ...
def mj_fwdPosition(m: MjModel, d: MjData) -> None: ...
def mj_fullM(m: MjModel, d: MjData, dst: _Floats) -> None: ...
def mj_geomDistance(
    m: MjModel, d: MjData, geom1: int, geom2: int, distmax: float, fromto: _Floats | None
) -> float: ...
def mj_id2name(m: MjModel, type: int, id: int) -> str | None: ...
def mj_jacBody(
    m: MjModel, d: MjData, jacp: _Floats | None, jacr: _Floats | None, body: int
) -> None: ...
def mj_kinematics(m: MjModel, d: MjData) -> None: ...
def mj_name2id(m: MjModel, type: int, name: str) -> int: ...  # -1 when there is none
def mj_objectVelocity(
    m: MjModel, d: MjData, objtype: int, objid: int, res: _Floats, flg_local: int
) -> None: ...
def mj_ray(
    m: MjModel,
    d: MjData,
    pnt: _Floats,
    vec: _Floats,
    geomgroup: _Bytes | None,
    flg_static: bool,
    bodyexclude: int,
    geomid: _Ints | None,
    normal: _Floats | None = None,
) -> float: ...
def mj_saveModel(m: MjModel, filename: str) -> None: ...
def mj_step(m: MjModel, d: MjData, nstep: int = 1) -> None: ...
def mjr_readPixels(
    rgb: _Bytes | None, depth: NDArray[np.float32] | None, viewport: MjrRect, con: MjrContext
) -> None: ...
def mjr_render(viewport: MjrRect, scn: MjvScene, con: MjrContext) -> None: ...
def mjr_setBuffer(framebuffer: int, con: MjrContext) -> None: ...
def mju_mat2Quat(quat: _Floats, mat: _Floats) -> None: ...
def mju_mulQuat(res: _Floats, quat1: _Floats, quat2: _Floats) -> None: ...
def mju_negQuat(res: _Floats, quat: _Floats) -> None: ...
def mju_quat2Mat(res: _Floats, quat: _Floats) -> None: ...
def mju_rotVecQuat(res: _Floats, vec: _Floats, quat: _Floats) -> None: ...
def mjv_connector(geom: MjvGeom, type: int, width: float, from_: _Floats, to: _Floats) -> None: ...
def mjv_initGeom(
    geom: MjvGeom,
    type: int,
    size: _Floats,
    pos: _Floats,
    mat: _Floats,
    rgba: NDArray[np.float32],
) -> None: ...
def mjv_updateScene(
    m: MjModel,
    d: MjData,
    opt: MjvOption,
    pert: None,
    cam: MjvCamera,
    catmask: int,
    scn: MjvScene,
) -> None: ...

class mjtBias(enum.IntEnum):
    mjBIAS_NONE = 0
    mjBIAS_AFFINE = 1

def set_mju_user_warning(handler: Callable[[str], object] | None) -> None: ...

class mjtBuiltin(enum.IntEnum):
    mjBUILTIN_FLAT = 3

class mjtCamera(enum.IntEnum):
    mjCAMERA_FREE = 0
    mjCAMERA_FIXED = 2

class mjtCatBit(enum.IntEnum):
    mjCAT_DECOR = 4
    mjCAT_ALL = 7

class mjtDisableBit(enum.IntEnum):
    mjDSBL_CONSTRAINT = 1
    mjDSBL_CONTACT = 16
    mjDSBL_SPRING = 32
    mjDSBL_DAMPER = 64
    mjDSBL_FILTERPARENT = 1024

class mjtDyn(enum.IntEnum):
    mjDYN_NONE = 0
    mjDYN_FILTER = 2
    mjDYN_FILTEREXACT = 3

class mjtEnableBit(enum.IntEnum):
    mjENBL_OVERRIDE = 1
    mjENBL_ENERGY = 2

class mjtFontScale(enum.IntEnum):
    mjFONTSCALE_100 = 100

class mjtFramebuffer(enum.IntEnum):
    mjFB_OFFSCREEN = 1

class mjtGain(enum.IntEnum):
    mjGAIN_FIXED = 0
    mjGAIN_AFFINE = 1

class mjtIntegrator(enum.IntEnum):
    mjINT_RK4 = 1

class mjtGeom(enum.IntEnum):
    mjGEOM_PLANE = 0
    mjGEOM_HFIELD = 1
    mjGEOM_SPHERE = 2
    mjGEOM_CAPSULE = 3
    mjGEOM_ELLIPSOID = 4
    mjGEOM_CYLINDER = 5
    mjGEOM_BOX = 6
    mjGEOM_MESH = 7
    mjGEOM_SDF = 8

class mjtJoint(enum.IntEnum):
    mjJNT_FREE = 0
    mjJNT_SLIDE = 2
    mjJNT_HINGE = 3

class mjtMeshInertia(enum.IntEnum):
    mjMESH_INERTIA_SHELL = 3

class mjtObj(enum.IntEnum):
    mjOBJ_ACTUATOR = 19
    mjOBJ_JOINT = 3
    mjOBJ_HFIELD = 12
    mjOBJ_BODY = 1
    mjOBJ_SITE = 6
    mjOBJ_CAMERA = 7
    mjOBJ_FLEX = 9
    mjOBJ_MESH = 10
    mjOBJ_NUMERIC = 21

class mjtOrientation(enum.IntEnum):
    mjORIENTATION_QUAT = ...

class mjtRndFlag(enum.IntEnum):
    mjRND_REFLECTION = 2

class mjtTexture(enum.IntEnum):
    mjTEXTURE_2D = 0

class mjtTrn(enum.IntEnum):
    mjTRN_JOINT = 0
    mjTRN_JOINTINPARENT = 1
    mjTRN_SLIDERCRANK = 2
    mjTRN_SITE = 4
    mjTRN_BODY = 5

class mjtVisFlag(enum.IntEnum):
    mjVIS_CONVEXHULL = 0

class mjtWarning(enum.IntEnum):
    mjWARN_BADQPOS = 3
    mjWARN_BADQVEL = 4
    mjWARN_BADQACC = 5
    mjWARN_BADCTRL = 6

class mjtWrap(enum.IntEnum):
    mjWRAP_JOINT = 1
    mjWRAP_SITE = 3
