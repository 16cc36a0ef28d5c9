"""Fly through worlds of other packages and put what came of it into docs/foreign_worlds.md.

    python -m benchmarks.foreign_worlds

takes some minutes, most of them for the videos (`--no-video` leaves them out). What is not
installed is left out and told; docs/foreign_worlds.md says what to install. With `--only NAME` the
page stays as it is. Every run is that of `hzmp-sim run` with the arguments in the table: they go
through its command line. Run directories are below runs/foreign.
"""

from __future__ import annotations

import shlex
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import cyclopts
from PIL import Image

from benchmarks.foreign_cases import WORLDS, ForeignWorld
from hzmp_planners.errors import HzmpError
from hzmp_sim.bench.machine import hardware, machine, software
from hzmp_sim.bench.page import page_text, update_page
from hzmp_sim.bench.tables import Table, print_tables, seconds
from hzmp_sim.cli import app
from hzmp_sim.output.video import render_frame
from hzmp_sim.run import Run
from hzmp_sim.settings import RunSettings
from hzmp_sim.simulation import simulate

COMMAND = "python -m benchmarks.foreign_worlds"
RUNS = Path("runs/foreign")
_WIDTHS, _LARGEST = (640, 560, 480, 400), 150_000  # of a picture [pixels], and its size [bytes]
_LIBRARIES = ("mujoco", "numpy", "scipy", "clarabel")


@dataclass(frozen=True, eq=False)
class Flown:
    """A world and the run through it."""

    world: ForeignWorld
    command: str
    run: Run

    def row(self) -> list[str]:
        """What the table says of it."""
        m, times = self.run.metrics, self.run.metrics["timings_s"]
        kinds = Counter(g.type for g in self.run.scene.geoms if g.role == "obstacle")
        geoms = ", ".join(f"{count} {kind}" for kind, count in kinds.most_common())
        clearance, gap = m["min_clearance_m"], m["optimality_gap"]
        return [
            f"[{self.world.name}](#{self.world.name})",
            self.world.source,
            self.world.licence,
            f"{self.run.scene.n}-D {self.run.scene.body}",
            geoms,
            str(m["obstacles"]),
            str(m["leaves"]),
            m["status"].replace("_", " "),
            str(m["collision_steps"]),
            "-" if m["path_length_m"] is None else f"{m['path_length_m']:.3f}",
            "-" if gap is None else f"{100.0 * gap:.3f} %",
            "-" if clearance is None else f"{1e3 * clearance:.0f}",
            seconds(times["scene"]),
            seconds(times["decompose"] + times["graph"]),
            seconds(times["plan"]),
        ]


COLUMNS = (
    "world", "source", "licence", "body", "geoms that are obstacles", "obstacles", "leaves",
    "status", "collision steps", "path [m]", "gap", "least clearance [mm]", "read",
    "decompose", "plan",
)  # fmt: skip


def fly(world: ForeignWorld, *, video: bool) -> Flown:
    """Export a world and run `hzmp-sim run` on it.

    Raises:
        HzmpError: as that does.
    """
    folder = RUNS / "worlds"
    folder.mkdir(parents=True, exist_ok=True)
    out = RUNS / world.name
    asked = [*world.arguments, "--out", str(out)]
    words = ["run", str(world.export(folder)), *asked, *([] if video else ["--no-video"])]
    _, bound, _ = app.parse_args(words, exit_on_error=False, print_error=False)
    given = bound.arguments
    scene = given["world"].load(given["scene"])
    # The page is to say the same wherever the packages are installed.
    command = shlex.join(["hzmp-sim", "run", "WORLD", *asked])
    settings = given.get("settings", RunSettings())
    return Flown(world, command, simulate(scene, out, settings, command=command))


def picture(flown: Flown, folder: Path) -> Path:
    """A still of the way flown, from the camera of the video."""
    last = None if flown.run.log is None else -1
    file = folder / f"foreign_{flown.world.name}.png"
    for width in _WIDTHS:
        frame = Image.fromarray(render_frame(flown.run, last, width=width, height=3 * width // 4))
        # Colours by how far they are apart, not by how often they are there: the path is thin.
        frame.quantize(256, Image.Quantize.MAXCOVERAGE).save(file, optimize=True)
        if file.stat().st_size <= _LARGEST:
            break
    return file


def table(flown: Sequence[Flown], absent: Sequence[str]) -> Table:
    """All runs; `absent` are lines about worlds that were left out."""
    return Table("Runs", COLUMNS, [each.row() for each in flown], remarks=absent)


def section(flown: Flown, link: str) -> str:
    """What a world is, how it was run, what was warned of, and its picture, as Markdown."""
    lines = [
        f"## {flown.world.name}\n",
        f"{flown.world.what[0].upper()}{flown.world.what[1:]} ({flown.world.source}).\n",
        f"```bash\n{flown.command}\n```\n",
        *(f"- {text}" for text in flown.run.metrics["warnings"]),
        f"\n<!-- made by: {COMMAND} -->\n![{flown.world.name}, flown]({link})\n",
    ]
    return "\n".join(lines)


def main(
    page: Path = Path("docs/foreign_worlds.md"),
    *,
    only: list[str] | None = None,
    video: bool = True,
) -> None:
    """Fly through the worlds and write the generated part of the page and its pictures.

    Args:
        page: Markdown file.
        only: names of worlds; the page is not written then.
        video: render videos, too.
    """
    facts = machine(_LIBRARIES)
    flown, absent = [], []
    for world in WORLDS:
        if only and world.name not in only:
            continue
        if world.missing:
            absent.append(f"{world.name}: not run, {', '.join(world.missing)} not installed")
            continue
        print(f"== {world.name}", flush=True)
        try:
            flown.append(fly(world, video=video))
        except HzmpError as error:
            absent.append(f"{world.name}: refused: {error}")
    results = table(flown, absent)
    print_tables([results])
    if only:
        return
    introduction = f"{hardware(facts)}. {software(facts)}."
    update_page(
        page,
        lambda folder: [picture(each, folder) for each in flown],
        lambda links: "\n".join(
            [
                page_text(COMMAND, introduction, [results], []),
                *(section(each, link) for each, link in zip(flown, links, strict=True)),
            ]
        ),
    )


if __name__ == "__main__":
    cyclopts.run(main)
