"""The table that `hzmp-sim inspect` prints of a world with much to look at and little to hit."""

from pathlib import Path

import pytest

from hzmp_sim.console import print_scene
from hzmp_sim.scene import load_scene
from hzmp_sim.scene.passage import widest_body


def test_what_touches_nothing_shares_a_row(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    skins = "".join(
        f'<geom name="skin{k}" type="{kind}" size="0.1 0.1 0.1" contype="0" conaffinity="0"/>'
        for k, kind in enumerate(["box", "box", "cylinder", "box", "ellipsoid"])
    )
    walls = "".join(
        f'<geom name="wall{k}" type="box" size="0.1 0.5 1" pos="{k} 0 1"/>' for k in range(5)
    )
    file = tmp_path / "showroom.xml"
    file.write_text(f"<mujoco><worldbody>{skins}{walls}</worldbody></mujoco>")
    scene = load_scene(file, "point", (-1, 0, 1), (5, 0, 1))
    space = scene.free_space()
    print_scene(scene, space, widest_body(scene, space), {})
    out = capsys.readouterr().out
    assert "5 geoms (--json names them)" in out
    assert "box, cylinder, ellipsoid" in out
    assert "skin0" not in out
    assert all(f"wall{k}" in out for k in range(5)), "every obstacle has its row"
    assert "point_ball" in out
