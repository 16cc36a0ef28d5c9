"""The bundled worlds and bodies."""

from __future__ import annotations

from pathlib import Path


def models_dir() -> Path:
    """Folder of the bundled MJCF files: `models/` of a clone, `hzmp_sim/_models` of a wheel."""
    package = Path(__file__).resolve().parent
    installed = package / "_models"
    return installed if installed.is_dir() else package.parent / "models"


def world_names() -> tuple[str, ...]:
    """Names of the bundled worlds."""
    return tuple(sorted(scene.parent.name for scene in models_dir().glob("*/scene.xml")))


def world_path(name: str) -> Path:
    """File of the bundled world `name`."""
    return models_dir() / name / "scene.xml"


def body_path(name: str, *, planar: bool = False) -> Path:
    """File of the bundled body "point" (planar or spatial) or "quadrotor"."""
    if name == "point":
        return models_dir() / "bodies" / "point" / ("planar.xml" if planar else "spatial.xml")
    return models_dir() / "bodies" / name / "body.xml"
