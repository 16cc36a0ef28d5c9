"""Assets of files written into the model: the world of a run is one text, without other files."""

from __future__ import annotations

import mujoco

from hzmp_sim.scene.decompiled import file_mesh


def embed_assets(
    spec: mujoco.MjSpec, model: mujoco.MjModel, *, with_files: bool
) -> tuple[bool, tuple[str, ...]]:
    """Put compiled meshes and height fields into the spec they were compiled from.

    Meshes with texture coordinates, which MJCF text cannot hold, and textures stay files, unless
    `with_files`: the files are about to go away. Then the pictures are lost, with a warning.

    Returns:
        Whether the spec was changed, and warnings.
    """
    changed = [_embed_mesh(mesh, model, always=with_files) for mesh in spec.meshes]
    changed += [_embed_field(field, model) for field in spec.hfields]
    lost = [_drop_picture(texture) for texture in spec.textures] if with_files else []
    warnings = ("textures of files are left out: drawn grey",) if any(lost) else ()
    return any(changed + lost), warnings


def _embed_mesh(mesh: mujoco.MjsMesh, model: mujoco.MjModel, *, always: bool) -> bool:
    number = mujoco.mj_name2id(model, int(mujoco.mjtObj.mjOBJ_MESH), mesh.name)
    if not mesh.file or number < 0 or (model.mesh_texcoordadr[number] >= 0 and not always):
        return False
    vertices, triangles = file_mesh(model, number)
    mesh.uservert, mesh.userface = vertices.ravel(), triangles.ravel()
    mesh.file, mesh.content_type = "", ""
    # Compilation applied scale and reference pose already.
    mesh.scale, mesh.refpos, mesh.refquat = [1, 1, 1], [0, 0, 0], [1, 0, 0, 0]
    return True


def _embed_field(field: mujoco.MjsHField, model: mujoco.MjModel) -> bool:
    number = mujoco.mj_name2id(model, int(mujoco.mjtObj.mjOBJ_HFIELD), field.name)
    if not field.file or number < 0:
        return False
    field.nrow, field.ncol = int(model.hfield_nrow[number]), int(model.hfield_ncol[number])
    start = int(model.hfield_adr[number])
    field.userdata = model.hfield_data[start : start + field.nrow * field.ncol]
    field.file, field.content_type = "", ""
    return True


def _drop_picture(texture: mujoco.MjsTexture) -> bool:
    if not texture.file and not any(texture.cubefiles):
        return False
    texture.file, texture.content_type = "", ""
    texture.cubefiles = [""] * 6
    texture.builtin = mujoco.mjtBuiltin.mjBUILTIN_FLAT
    texture.rgb1, texture.width, texture.height = [0.5, 0.5, 0.5], 1, 1
    if texture.type != mujoco.mjtTexture.mjTEXTURE_2D:
        texture.height = 6
    return True
