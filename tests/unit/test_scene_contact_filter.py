"""The contact filter against MuJoCo's own contacts, on random models."""

import mujoco
import numpy as np
import pytest

from hzmp_sim.scene.contact_filter import contact_margins

FLAGS = (
    '<flag filterparent="disable"/>',
    '<flag contact="disable"/>',
    '<flag constraint="disable"/>',
    '<flag override="enable"/>',
)


def bodies(rng: np.random.Generator, names: list[str], prefix: str = "b", depth: int = 0) -> str:
    """Random tree of static, mocap and jointed bodies; every geom overlaps every other."""
    text = ""
    for k in range(int(rng.integers(1, 3))):
        name = f"{prefix}{k}"
        names.append(name)
        joint = str(rng.choice(["", '<joint type="hinge"/>', '<joint type="slide"/>']))
        if depth == 0:
            joint = str(rng.choice(["", "<freejoint/>", '<joint type="hinge"/>', "mocap"]))
        text += f'<body name="{name}" mocap="{str(joint == "mocap").lower()}">'
        text += joint.removesuffix("mocap")
        for i in range(int(rng.integers(1, 3))):
            text += (
                f'<geom name="{name}g{i}" size="{rng.uniform(0.5, 1.0)}"'
                f' margin="{rng.choice([0, 0.1])}"'
                f' contype="{rng.integers(0, 4)}" conaffinity="{rng.integers(0, 4)}"/>'
            )
        if depth < 3 and rng.random() < 0.6:
            text += bodies(rng, names, name, depth + 1)
        text += "</body>"
    return text


def random_model(seed: int) -> mujoco.MjModel:
    rng = np.random.default_rng(seed)
    names: list[str] = []
    tree = bodies(rng, names)
    contact = ""
    if len(names) > 1:
        for _ in range(int(rng.integers(0, 3))):
            a, b = rng.choice(names, 2, replace=False)
            contact += f'<exclude body1="{a}" body2="{b}"/>'
    if rng.random() < 0.5:
        a, b = rng.choice([f"{name}g0" for name in names] + ["world"], 2, replace=False)
        contact += f'<pair geom1="{a}" geom2="{b}" margin="0.07"/>'
    flag = str(rng.choice(FLAGS)) if rng.random() < 0.4 else ""
    return mujoco.MjModel.from_xml_string(
        f'<mujoco><option o_margin="0.03">{flag}</option>'
        f'<worldbody><geom name="world" type="box" size="1 1 1"/>{tree}</worldbody>'
        f"<contact>{contact}</contact></mujoco>"
    )


@pytest.mark.parametrize("block", range(10))
def test_same_contacts_and_margins_as_mujoco(block: int) -> None:
    touching = 0
    for seed in range(40 * block, 40 * block + 40):
        model = random_model(seed)
        data = mujoco.MjData(model)
        mujoco.mj_forward(model, data)
        expected = np.full((model.ngeom, model.ngeom), np.nan)
        for contact in data.contact:
            a, b = contact.geom
            expected[a, b] = expected[b, a] = contact.includemargin
        margins = contact_margins(model, tuple(range(model.ngeom)))
        np.testing.assert_allclose(margins, expected, err_msg=f"seed {seed}")
        touching += int(data.ncon > 0)
    assert touching > 10
