"""Every refusal is one line that names the thing and says what would be valid."""

from pathlib import Path
from typing import Any

import pytest

from hzmp_planners.errors import HzmpError, QueryError, SceneError, ShapeError
from hzmp_sim.scene import load_scene
from hzmp_sim.simulation import simulate

GOOD = """<mujoco>
  <custom><numeric name="workspace" data="-3 -2 0 3 2 2"/></custom>
  <asset><mesh name="tent" vertex="0 0 0  1 0 0  0 1 0  0 0 1"/></asset>
  <worldbody>
    <site name="start" pos="-2 0 1"/><site name="goal" pos="2 0 1"/>
    <geom name="wall" type="box" pos="0 0 1" size="0.15 1 1"/>
    <!-- more -->
  </worldbody>
  <!-- tail -->
</mujoco>"""


def refusal(file: Path, **arguments: Any) -> HzmpError:
    with pytest.raises(HzmpError) as caught:
        load_scene(file, **arguments)
    text = str(caught.value)
    assert "\n" not in text
    assert len(text) < 400
    return caught.value


def changed(folder: Path, old: str, new: str) -> Path:
    assert old in GOOD
    file = folder / "scene.xml"
    file.write_text(GOOD.replace(old, new))
    return file


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ("</mujoco>", "", ["scene.xml", "not well-formed XML", "line"]),
        ("<worldbody>", '<worldbody><geom type="box"', ["scene.xml"]),
        ("<asset>", '<include file="rooms.xml"/><asset>', ["rooms.xml", "line 3"]),
        ('size="0.15 1 1"', 'size="0.15 1 -1"', ["wall", "size"]),
        ('size="0.15 1 1"', 'size="nan 1 1"', ["scene.xml", "NaN"]),
        ('pos="0 0 1"', 'pos="nan 0 1"', ["scene.xml", "NaN"]),
        ('name="wall"', 'name="wall" margin="1e7"', ["wall", "margin of 1e+07 m", "5.8 m"]),
        ('type="box"', 'type="mesh" mesh="nothing"', ["nothing"]),
        ("<asset>", '<asset><mesh name="rock" file="rock.obj"/>', ["rock.obj"]),
        ('vertex="0 0 0  1 0 0  0 1 0  0 0 1"', 'vertex=""', ["tent"]),
        ('0 0 1"/></asset>', '1 1 0"/></asset>', ["tent", "coplanar"]),
        ("<!-- more -->", '<composite type="grid"/>', ["composite", "MuJoCo 4"]),
        ("<asset>", '<include file="scene.xml"/><asset>', ["scene.xml -> scene.xml", "itself"]),
        ("<asset>", '<asset><model name="m" file="scene.xml"/>', ["scene.xml -> scene.xml"]),
        (
            "<asset>",
            '<asset><hfield name="deep" nrow="100000" ncol="100000" size="1 1 1 1"/>',
            ["'deep'", "100000 x 100000", "25,000,000"],
        ),
        (
            "<asset>",
            '<worldbody><geom type="hfield" hfield="thin"/></worldbody><asset>'
            '<hfield name="thin" nrow="2" ncol="2" size="1e-12 1 1 1"/>',
            ["'thin'", "2e-12 m wide", "1e-06 m"],
        ),
        ("<mujoco", '<!DOCTYPE mujoco [<!ENTITY a "b">]><mujoco', ["scene.xml", "entities"]),
        (
            "<!-- more -->",
            '<replicate count="200"><replicate count="51"><geom size="1"/></replicate></replicate>',
            ['count="51"', "10200 copies", "10000"],
        ),
        ('<site name="goal" pos="2 0 1"/>', "", ['<site name="goal"', "--goal"]),
        ('<site name="start" pos="-2 0 1"/>', "", ['<site name="start"', "--start"]),
        ('data="-3 -2 0 3 2 2"', 'data="-3 -2 0 3 2"', ["workspace", "5 entries"]),
        ('data="-3 -2 0 3 2 2"', 'data="-3 -2 0 -4 2 2"', ["workspace", "along x"]),
        ('data="-3 -2 0 3 2 2"', 'data="-3 -2 0 3 -1.9 2"', ["0.1 m wide along y", "0.2 m"]),
        ('pos="2 0 1"', 'pos="5 0 1"', ["goal (5, 0)", "outside", "(-2.9, -1.9) to (2.9, 1.9)"]),
        ('pos="2 0 1"', 'pos="0.2 0 1"', ["goal", "inside obstacle wall", "0.1 m"]),
        ('pos="-2 0 1"', 'pos="0.1 0 1"', ["start", "inside obstacle wall", "0.2 m"]),
        (
            "<!-- more -->",
            '<body name="door"><joint/><geom name="leaf" type="sdf" mesh="tent"/></body>',
            ["leaf is a sdf geom on a body that moves", "valid there are box, sphere"],
        ),
        (
            "<!-- tail -->",
            '<deformable><flex name="cloth" dim="1" body="world" vertex="0 0 0 1 0 0"'
            ' element="0 1"/></deformable>',
            ["cloth", "flex"],
        ),
    ],
)
def test_broken_worlds(tmp_path: Path, old: str, new: str, says: list[str]) -> None:
    text = str(refusal(changed(tmp_path, old, new)))
    for part in says:
        assert part in text


@pytest.mark.parametrize(
    ("arguments", "kind", "says"),
    [
        ({"body": "helicopter"}, SceneError, ["'helicopter'", "point, quadrotor"]),
        ({"start": (float("nan"), 0, 1)}, ShapeError, ["start", "nan"]),
        ({"goal": (0, float("inf"))}, ShapeError, ["goal", "inf"]),
        ({"start": (1, 2, 3, 4)}, QueryError, ["start", "2 or 3"]),
        ({"start": "here"}, ShapeError, ["start"]),
        ({"goal": (2, 1.99, 1)}, QueryError, ["goal", "outside"]),
        ({"goal": (2, 0, 1.99), "body": "point"}, QueryError, ["goal", "outside"]),
        ({"start": (-2, 0), "goal": (2, 0, 1.5)}, QueryError, ["z = 1.5", "z = 1"]),
        ({"workspace": ((0, 0), (1, 1, 1))}, SceneError, ["2 and 3"]),
        ({"workspace": ((0, 0, 0),)}, SceneError, ["(lo, hi)"]),
        ({"workspace": ((-3, -2), (3, 2)), "body": "quadrotor"}, SceneError, ["3-D", "z"]),
        ({"clearance": -0.1}, SceneError, ["clearance", ">= 0", "-0.1"]),
        ({"clearance": float("nan")}, SceneError, ["clearance", "nan"]),
        ({"tolerance": 0.0}, SceneError, ["tolerance", "> 0"]),
        ({"clearance": 1.9}, QueryError, ["inside obstacle wall"]),
    ],
)
def test_bad_arguments(
    tmp_path: Path, arguments: dict[str, Any], kind: type[HzmpError], says: list[str]
) -> None:
    error = refusal(changed(tmp_path, "<!-- more -->", ""), **arguments)
    assert isinstance(error, kind)
    for part in says:
        assert part in str(error)


@pytest.mark.parametrize(
    ("body", "actuators", "says"),
    [
        ('<body name="arm"><joint name="j"/><geom size="0.1"/></body>', "j", ["'arm'", "hinge"]),
        (
            '<body name="lift"><joint name="j" type="slide"/><geom size="0.1"/></body>',
            "j",
            ["slide"],
        ),
        (
            '<body name="ghost"><freejoint name="j"/><geom size="0.1" contype="0" conaffinity="0"/>'
            "</body>",
            "j",
            ["ghost", "no geom that can collide"],
        ),
        (
            '<body name="car"><freejoint name="j"/><geom size="0.1"/>'
            '<body name="wheel"><joint/><geom size="0.1"/></body></body>',
            "j",
            ["'car'", "'wheel'", "rigid"],
        ),
        (
            '<body name="one"><freejoint name="j"/><geom size="0.1"/></body>'
            '<body name="two"><freejoint name="k"/><geom size="0.1"/></body>',
            "j k",
            ["one, two", "--body"],
        ),
        ('<body><freejoint name="j"/><geom size="0.1"/></body>', "j", ["no name"]),
    ],
)
def test_bodies_that_cannot_be_planned(
    tmp_path: Path, body: str, actuators: str, says: list[str]
) -> None:
    file = changed(tmp_path, "<!-- more -->", body)
    motors = "".join(f'<motor joint="{name}"/>' for name in actuators.split())
    file.write_text(file.read_text().replace("<!-- tail -->", f"<actuator>{motors}</actuator>"))
    text = str(refusal(file))
    for part in says:
        assert part in text


def test_files_that_are_not_worlds(tmp_path: Path) -> None:
    assert "no such file" in str(refusal(tmp_path / "missing.xml"))
    assert "bundled worlds: crossing_traffic, enclosure, maze" in str(refusal(Path("mase")))
    assert "folder" in str(refusal(tmp_path))
    empty = tmp_path / "empty.xml"
    empty.write_text("")
    assert "empty.xml" in str(refusal(empty))
    part = tmp_path / "part.xml"
    part.write_text('<mujocoinclude><asset><texture name="sky"/></asset></mujocoinclude>')
    assert "a part that other files include" in str(refusal(part))
    picture = tmp_path / "picture.xml"
    picture.write_bytes(bytes(range(256)))
    assert "picture.xml" in str(refusal(picture))


def test_names_in_another_encoding(tmp_path: Path) -> None:
    file = changed(tmp_path, 'name="wall"', 'name="w\N{LATIN SMALL LETTER A WITH DIAERESIS}nd"')
    file.write_bytes(file.read_text().encode("latin-1"))
    text = str(refusal(file))
    assert "scene.xml is not UTF-8" in text
    assert "0xe4" in text
    file.write_bytes(GOOD.replace("more", "\N{DEGREE SIGN}").encode("latin-1"))
    assert load_scene(file).body == "point"  # a comment may be in any


def test_world_without_geoms_needs_a_workspace(tmp_path: Path) -> None:
    file = tmp_path / "void.xml"
    file.write_text('<mujoco><worldbody><geom type="plane" size="1 1 1"/></worldbody></mujoco>')
    assert 'numeric name="workspace"' in str(refusal(file, start=(0, 0, 1), goal=(1, 0, 1)))


def test_time_step_too_short_to_fly(tmp_path: Path) -> None:
    file = changed(tmp_path, "<asset>", '<option timestep="1e-30"/><asset>')
    with pytest.raises(SceneError, match=r"timestep = 1e-30 s needs .* 0\.002 s is usual"):
        simulate(load_scene(file), tmp_path / "run")
