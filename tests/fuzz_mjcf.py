"""Broken MJCF files: each is planned or refused in one line, never a traceback, hang or crash.

`python -m tests.fuzz_mjcf 300 [FIRST_SEED]` from the root of the checkout prints what is wrong.
"""

from __future__ import annotations

import json
import os
import select
import shutil
import subprocess
import sys
import tempfile
import xml.etree.ElementTree as ET
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Self

import numpy as np

ROOT = Path(__file__).resolve().parents[1]
LIMIT = 20.0
"""How long one file may take [s]."""
EVERY_RUN = 10
"""One file in so many is flown as well."""

VALUES = (
    "", "0", "-1", "nan", "inf", "1e30", "-1e30", "1e-30", "1e999", "0 0 0", "-1 -2 -3", "1", "1 2",
    "true", "none", "\N{SNOWMAN}", "x" * 5000, "0 " * 20_000, "2147483648", "-2147483649", "../..",
    "box", "mesh", "plane", "hfield", "sdf", "start", "goal", "workspace", "world", "scene.xml",
)  # fmt: skip
NUMBERS = ("0", "-0", "-1", "nan", "-inf", "1e30", "1e-12", "1e7", "1e5", "0.05", "9", "x", "")

FEATURES = """<mujoco model="features">
  <compiler angle="radian" autolimits="true"/>
  <option timestep="0.002"><flag multiccd="enable"/></option>
  <custom><numeric name="workspace" data="-3 -3 0 3 3 3"/></custom>
  <default><geom margin="0.01"/>
    <default class="thin"><geom size="0.05 0.5 0.5"/></default></default>
  <include file="part.xml"/>
  <asset>
    <texture name="checks" type="2d" builtin="checker" width="16" height="16"/>
    <material name="checks" texture="checks"/>
    <mesh name="tent" scale="1 -1 1" vertex="0 0 0  1 0 0  0 1 0  0 0 1"/>
    <hfield name="hills" nrow="3" ncol="4" size="0.5 0.5 0.3 0.1"
            elevation="0 1 2 0  1 0 2 1  0 0 1 1"/>
  </asset>
  <worldbody>
    <light pos="0 0 3"/><camera name="eye" pos="0 -5 2" xyaxes="1 0 0 0 0.3 1"/>
    <geom name="floor" type="plane" size="5 5 0.1" material="checks"/>
    <geom name="hills" type="hfield" hfield="hills" pos="1.5 1.5 0.1"/>
    <geom name="tent" type="sdf" mesh="tent" pos="-1.5 1.5 1"/>
    <geom name="tent2" type="mesh" mesh="tent" pos="1.5 -1.5 1" euler="0.1 0.2 0.3"/>
    <frame pos="0 0 1" euler="0 0 0.5"><geom name="slab" class="thin" type="box"/></frame>
    <replicate count="3" offset="0 0.6 0"><geom type="cylinder" size="0.1 0.4" pos="-1 -1 0.5"/>
    </replicate>
    <body name="lift" mocap="true" pos="0 2 1"><geom type="capsule" size="0.1 0.2"/></body>
    <body name="drone" pos="-2.4 0 1"><freejoint name="free"/>
      <geom name="hull" type="ellipsoid" size="0.15 0.1 0.05" mass="0.5"/>
      <site name="thrust"/>
    </body>
    <site name="goal" pos="2.4 0 1"/>
  </worldbody>
  <contact><exclude body1="drone" body2="lift"/><pair geom1="hull" geom2="slab" margin="0.02"/>
  </contact>
  <actuator><motor name="up" site="thrust" gear="0 0 1 0 0 0" ctrlrange="0 10"/></actuator>
  <sensor><accelerometer site="thrust"/></sensor>
  <keyframe><key name="home" qpos="-2.4 0 1 1 0 0 0"/></keyframe>
</mujoco>"""
PART = """<mujoco><worldbody><body name="crates" pos="1 0 0.5">
  <geom name="crate" type="box" size="0.2 0.2 0.2" solref="0.01 1"/>
  <geom name="ball" size="0.1" pos="0 0 0.4" contype="2" conaffinity="3"/>
  </body></worldbody></mujoco>"""
CLOTH = """<mujoco><custom><numeric name="workspace" data="-3 -3 0 3 3 3"/></custom>
  <worldbody><site name="start" pos="-2 0 1"/><site name="goal" pos="2 0 1"/>
    <flexcomp name="cloth" type="grid" count="3 3 1" spacing="0.2 0.2 0.2" radius="0.01">
      <contact contype="0" conaffinity="0"/></flexcomp>
    <body name="door" pos="0 1 1"><joint name="hinge" axis="0 0 1" range="-90 90"/>
      <geom name="leaf" type="box" size="0.3 0.05 0.5" contype="0" conaffinity="0"/></body>
    <geom name="wall" type="box" size="0.1 1 1" pos="0 0 1"/>
  </worldbody><equality><joint joint1="hinge"/></equality>
  <tendon><fixed name="t"><joint joint="hinge" coef="1"/></fixed></tendon></mujoco>"""
CAR = """<mujoco><worldbody>
  <body name="car" pos="-1 0 0.2"><joint name="x" type="slide" axis="1 0 0" range="-2 2"/>
    <joint name="y" type="slide" axis="0 1 0"/><joint name="turn" axis="0 0 1"/>
    <geom type="box" size="0.2 0.1 0.1"/></body>
  <geom name="a" type="box" size="0.1 0.4 0.4" pos="0 0 0.3"/>
  <geom name="b" type="box" size="0.1 0.1 0.4" pos="3 3 0.3"/>
  <geom name="c" type="box" size="0.1 0.1 0.4" pos="-3 -3 0.3"/>
  <site name="goal" pos="1.5 0 0.2"/></worldbody>
  <actuator><position joint="x" kp="20"/><motor joint="y"/><velocity joint="turn"/></actuator>
  </mujoco>"""
WRITTEN = {"features": FEATURES, "cloth": CLOTH, "car": CAR}


@dataclass(frozen=True)
class Outcome:
    """What became of one command."""

    code: int | None
    """Exit code; None: it hung, crashed or raised."""
    out: str
    """What it wrote, or what happened instead."""

    @property
    def complaint(self) -> str:
        """What is wrong with it; "" when it ended as it should."""
        if self.code is None or "Traceback (most recent call last)" in self.out:
            return self.out
        if self.code not in (0, 2, 3, 4, 5):
            return f"exit code {self.code}: {self.out}"
        errors = [line for line in self.out.splitlines() if not line.startswith("hzmp-sim: warn")]
        if self.code == 2 and not (len(errors) == 1 and errors[0].startswith("hzmp-sim: error: ")):
            return f"not one line: {self.out}"
        return f"an endless line: {self.out[:500]}" if len(self.out) > 8000 else ""


class Worker:
    """A process that runs commands one after the other; a new one when it hung or crashed."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._process: subprocess.Popen[bytes] | None = None

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._stop()

    def run(self, arguments: list[str]) -> Outcome:
        process = self._process or self._start()
        assert process.stdin is not None
        assert process.stdout is not None
        process.stdin.write(json.dumps(arguments).encode() + b"\n")
        process.stdin.flush()
        ready, _, _ = select.select([process.stdout], [], [], LIMIT)
        answer = process.stdout.readline() if ready else b""
        if answer:
            return Outcome(*json.loads(answer))
        self._stop()
        how = f"crashed with code {process.returncode}" if ready else f"hung for {LIMIT:g} s"
        return Outcome(None, f"{how}: {(self._folder / 'said').read_text(errors='replace')[-500:]}")

    def _start(self) -> subprocess.Popen[bytes]:
        paths = [ROOT, ROOT / "planners", ROOT / "tracking"]
        environment = {**os.environ, "PYTHONPATH": os.pathsep.join(map(str, paths))}
        process = subprocess.Popen(
            [sys.executable, "-X", "faulthandler", str(Path(__file__)), "--worker"],
            cwd=self._folder,
            env={**environment, "MPLBACKEND": "Agg"},
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
        )
        self._process = process
        return process

    def _stop(self) -> None:
        if self._process is not None:
            self._process.kill()
            self._process.communicate()
        self._process = None


def work() -> None:
    """Run the commands on stdin, one JSON list a line; what they write goes to the file `said`."""
    import traceback

    from hzmp_sim.cli import main

    answers = os.fdopen(os.dup(1), "w")
    for line in sys.stdin:
        with Path("said").open("w+", errors="replace") as said:
            os.dup2(said.fileno(), 1)
            os.dup2(said.fileno(), 2)
            code: int | None = None
            try:
                main(json.loads(line))
            except SystemExit as end:
                code = end.code if isinstance(end.code, int) else None
            except BaseException:
                traceback.print_exc()
            sys.stdout.flush()
            sys.stderr.flush()
            said.seek(0)
            answers.write(json.dumps([code, said.read()]) + "\n")
            answers.flush()


def write_world(seed: int, folder: Path) -> tuple[Path, str]:
    """A broken world in the folder, and how it was broken."""
    rng = np.random.default_rng(seed)
    worlds = sorted((ROOT / "models").glob("*/scene.xml"))
    worlds += [
        *sorted((ROOT / "models" / "bodies").glob("*/*.xml")),
        ROOT / "tests/data/all_geoms.xml",
    ]
    choice = int(rng.integers(len(worlds) + 3 * len(WRITTEN)))
    file = folder / "scene.xml"
    if choice < len(worlds):
        for path in worlds[choice].parent.iterdir():
            if path.is_file() and path.suffix in (".obj", ".xml"):
                shutil.copy(path, folder)
        name = worlds[choice].name
        text = (folder / name).read_text()
    else:
        name = list(WRITTEN)[choice % len(WRITTEN)]
        text = WRITTEN[name]
        (folder / "part.xml").write_text(PART)
    done = []
    if rng.random() < 0.75:
        root = ET.fromstring(text)
        for _ in range(int(rng.integers(1, 4))):
            change = ELEMENTS[int(rng.integers(len(ELEMENTS)))]
            done.append(change(rng, root))
        text = ET.tostring(root, encoding="unicode")
    raw = text.encode()
    if not done or rng.random() < 0.1:
        spoil = BYTES[int(rng.integers(len(BYTES)))]
        done.append(spoil.__name__)
        raw = spoil(rng, raw)
    if rng.random() < 0.15:
        done.append(spoil_assets(rng, folder))
    file.write_bytes(raw)
    return file, f"{name}: {'; '.join(done)}"


def pick(rng: np.random.Generator, root: ET.Element) -> ET.Element:
    everything = list(root.iter())
    return everything[int(rng.integers(len(everything)))]


def short(element: ET.Element) -> str:
    return f"<{element.tag} name={element.get('name')!r}>"


def change_value(rng: np.random.Generator, root: ET.Element) -> str:
    able = [element for element in root.iter() if element.attrib]
    element = able[int(rng.integers(len(able)))] if able else root
    key = str(rng.choice([*element.attrib] or ["model"]))
    element.set(key, str(rng.choice(VALUES)))
    return f"{short(element)} {key}={element.get(key, '')[:40]!r}"


def change_number(rng: np.random.Generator, root: ET.Element) -> str:
    found = [(e, k) for e in root.iter() for k, v in e.attrib.items() if v[:1] in "-0123456789."]
    if not found:
        return "no number"
    element, key = found[int(rng.integers(len(found)))]
    words = element.get(key, "").split() or ["0"]
    words[int(rng.integers(len(words)))] = str(rng.choice(NUMBERS))
    element.set(key, " ".join(words))
    return f"{short(element)} {key}={element.get(key, '')[:60]!r}"


def drop_attribute(rng: np.random.Generator, root: ET.Element) -> str:
    element = pick(rng, root)
    if not element.attrib:
        return "nothing"
    key = str(rng.choice([*element.attrib]))
    del element.attrib[key]
    return f"{short(element)} without {key}"


def move_attribute(rng: np.random.Generator, root: ET.Element) -> str:
    source, target = pick(rng, root), pick(rng, root)
    target.attrib.update(source.attrib)
    return f"attributes of {short(source)} to <{target.tag}>"


def drop_element(rng: np.random.Generator, root: ET.Element) -> str:
    parent = pick(rng, root)
    if not len(parent):
        return "nothing"
    child = parent[int(rng.integers(len(parent)))]
    parent.remove(child)
    return f"without {short(child)}"


def copy_element(rng: np.random.Generator, root: ET.Element) -> str:
    source, target = pick(rng, root), pick(rng, root)
    if any(element is target for element in source.iter()):
        return "nothing"
    for _ in range(int(rng.choice([1, 2, 50]))):
        target.append(source)
    return f"{short(source)} again in <{target.tag}>"


def rename(rng: np.random.Generator, root: ET.Element) -> str:
    element, old = pick(rng, root), ""
    old, element.tag = element.tag, str(rng.choice(["geom", "body", "joint", "mesh", "thing"]))
    return f"<{old}> is <{element.tag}>"


def add_element(rng: np.random.Generator, root: ET.Element) -> str:
    added = (
        '<include file="scene.xml"/>', '<include file="nothing.xml"/>', '<include file=""/>',
        '<geom type="mesh" mesh="nothing"/>', '<mesh name="gone" file="gone.obj"/>',
        '<hfield name="none" nrow="0" ncol="0" size="1 1 1 1"/>', '<freejoint/>',
        '<body name="loose"><freejoint/><geom size="0.1"/></body>', '<motor joint="nothing"/>',
        '<numeric name="workspace" data="0 0 0 1"/>', '<texture name="t" file="gone.png"/>',
        '<replicate count="100000"><geom size="1"/></replicate>', '<site name="goal"/>',
        '<composite type="cable" count="3 1 1"/>', '<plugin plugin="mujoco.none"/>',
        '<geom name="huge" type="box" size="1e5 1e5 1e5"/>', '<geom type="sphere" size="1e-9"/>',
        '<hfield name="deep" nrow="100000" ncol="100000" size="1 1 1 1"/>',
        '<model name="other" file="scene.xml"/>', '<option gravity="nan 0 0" timestep="-1"/>',
    )  # fmt: skip
    text = str(rng.choice(added))
    places = [e for e in root.iter() if e.tag in ("mujoco", "worldbody", "asset", "body", "custom")]
    places = places or [root]
    place = places[int(rng.integers(len(places)))]
    place.append(ET.fromstring(text))
    return f"{text} in <{place.tag}>"


ELEMENTS: tuple[Callable[[np.random.Generator, ET.Element], str], ...] = (
    change_value, change_value, change_number, change_number, drop_attribute, move_attribute,
    drop_element, copy_element, rename, add_element, add_element,
)  # fmt: skip


def truncated(rng: np.random.Generator, raw: bytes) -> bytes:
    return raw[: int(rng.integers(len(raw)))]


def noisy(rng: np.random.Generator, raw: bytes) -> bytes:
    noise = bytearray(raw)
    for place in rng.integers(len(raw), size=int(rng.integers(1, 30))):
        noise[place] = int(rng.integers(256))
    return bytes(noise)


def binary(rng: np.random.Generator, raw: bytes) -> bytes:
    return rng.bytes(int(rng.integers(len(raw))))


def two_bytes(rng: np.random.Generator, raw: bytes) -> bytes:
    return raw.decode().encode(str(rng.choice(["utf-16", "utf-32", "utf-8-sig"])))


def wrong_encoding(rng: np.random.Generator, raw: bytes) -> bytes:
    label = str(rng.choice(["utf-16", "latin-1", "nonsense"]))
    return f'<?xml version="1.0" encoding="{label}"?>'.encode() + raw.replace(b"goal", b"g\xf6al")


def doubled(rng: np.random.Generator, raw: bytes) -> bytes:
    return raw * int(rng.integers(2, 4))


def entities(rng: np.random.Generator, raw: bytes) -> bytes:
    levels = "".join(f'<!ENTITY e{i} "{f"&e{i - 1};" * 10}">' for i in range(1, 10))
    return f'<!DOCTYPE m [<!ENTITY e0 "ha">{levels}]>'.encode() + raw.replace(b'"goal"', b'"&e9;"')


def nested(rng: np.random.Generator, raw: bytes) -> bytes:
    deep = int(rng.choice([100, 3000]))
    return raw.replace(b"</worldbody>", b"<body>" * deep + b"</body>" * deep + b"</worldbody>")


BYTES = (truncated, noisy, noisy, binary, two_bytes, wrong_encoding, doubled, entities, nested)


def spoil_assets(rng: np.random.Generator, folder: Path) -> str:
    files = sorted(path for path in folder.iterdir() if path.name != "scene.xml")
    if not files:
        return "no assets"
    path = files[int(rng.integers(len(files)))]
    what = str(rng.choice(["gone", "empty", "noisy", "truncated", "folder"]))
    raw = path.read_bytes()
    path.unlink()
    if what == "folder":
        path.mkdir()
    elif what != "gone":
        spoil = {"empty": lambda *_: b"", "noisy": noisy, "truncated": truncated}[what]
        path.write_bytes(spoil(rng, raw))
    return f"{path.name} {what}"


def outcomes(seeds: range) -> Iterator[tuple[str, Outcome]]:
    """Description and outcome of each command on each world."""
    with tempfile.TemporaryDirectory() as base, Worker(Path(base)) as worker:
        for seed in seeds:
            folder = Path(base) / str(seed)
            folder.mkdir()
            file, story = write_world(seed, folder)
            yield f"seed {seed}, {story}: plan", worker.run(["plan", str(file)])
            if seed % EVERY_RUN == 0:
                command = ["run", str(file), "--no-video", "--out", str(folder / "run")]
                yield f"seed {seed}, {story}: run", worker.run(command)
            shutil.rmtree(folder)


def main() -> None:
    """Look at as many files as the command line says."""
    count, first = (*map(int, sys.argv[1:]), 0)[:2] if len(sys.argv) > 1 else (300, 0)
    codes: dict[str, int] = {}
    for story, outcome in outcomes(range(first, first + count)):
        codes[str(outcome.code)] = codes.get(str(outcome.code), 0) + 1
        if outcome.complaint:
            print(f"{story}\n    {outcome.complaint}", flush=True)
    print(f"{count} files, commands by exit code: {codes}")


if __name__ == "__main__":
    work() if sys.argv[1:] == ["--worker"] else main()
