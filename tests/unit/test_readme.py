"""What README.md and docs/*.md show is run, parsed or looked up. The conventions:

- ```python blocks of a file run in order, in one namespace, in an empty folder that holds only
  `models/`. A ```text block right after one is its output (`...` stands for anything; what it
  prints must be shown).
- Lines of ```bash blocks, and those after `$ ` in ```console blocks, are commands. `hzmp-sim` ones
  are parsed, not run; `make` ones must be targets, and what these run is parsed too.
- Each picture has `<!-- made by: COMMAND -->` on the line before it, and so can tables: a command
  as above, or `python FILE ...`.
"""

from __future__ import annotations

import contextlib
import doctest
import io
import itertools
import re
import shlex
import shutil
import subprocess
from pathlib import Path
from typing import Any, NamedTuple

import pytest

ROOT = Path(__file__).resolve().parents[2]
README = ROOT / "README.md"
PAGES = [README, *sorted((ROOT / "docs").glob("*.md"))]

FENCE = re.compile(r"^```(\w*)[^\n]*\n(.*?)^```[ ]*$", re.MULTILINE | re.DOTALL)
COMMENT = re.compile(r"<!-- made by: (.+?) -->")
LINK = re.compile(r"(!?)\[[^\]]*\]\(([^)\s]+)[^)]*\)|<img[^>]* src=\"([^\"]+)\"")


class Block(NamedTuple):
    line: int
    language: str
    text: str
    output: str | None
    """Text block that follows with nothing but blank lines between."""


def blocks(page: Path) -> list[Block]:
    text = page.read_text(encoding="utf-8")
    found = list(FENCE.finditer(text))
    result = []
    for match, following in itertools.zip_longest(found, found[1:]):
        output = None
        if (
            following
            and following[1] == "text"
            and not text[match.end() : following.start()].strip()
        ):
            output = following[2]
        line = text.count("\n", 0, match.start()) + 1
        result.append(Block(line, match[1], match[2], output))
    return result


def shell_commands(page: Path) -> list[str]:
    lines: list[str] = COMMENT.findall(page.read_text(encoding="utf-8"))
    for block in blocks(page):
        text = block.text.replace("\\\n", " ")
        if block.language == "bash":
            lines += text.splitlines()
        elif block.language == "console":
            lines += [line[2:] for line in text.splitlines() if line.startswith("$ ")]
    stripped = (re.sub(r"(^|\s)#.*", "", line).strip() for line in lines)
    return [line for line in stripped if line]


def prose(page: Path) -> str:
    return FENCE.sub("", page.read_text(encoding="utf-8"))


def check_command(line: str) -> None:
    """Fail unless the command of ours in this line could be started."""
    words = shlex.split(line)
    if words[0] == "make":
        done = subprocess.run(
            ["make", "--dry-run", *words[1:]], cwd=ROOT, capture_output=True, text=True, check=False
        )
        assert done.returncode == 0, f"{line}: {done.stderr}"
        for step in done.stdout.splitlines():
            if "/hzmp-sim " in step:
                check_command(step[step.index("hzmp-sim ") :])
    elif words[0] == "hzmp-sim":
        from cyclopts.exceptions import CycloptsError

        from hzmp_sim.cli import app

        try:
            app.parse_args(words[1:], exit_on_error=False, print_error=False)
        except CycloptsError as error:
            pytest.fail(f"{line}: {error}")
    elif words[0] == "python" and words[1] != "-m":
        assert (ROOT / words[1]).is_file(), line


def test_readme_shows_code_with_its_output_and_both_commands() -> None:
    assert any(block.language == "python" and block.output for block in blocks(README))
    assert {"make demo", "make test"} <= set(shell_commands(README))


@pytest.mark.parametrize(
    "page",
    [page for page in PAGES if any(block.language == "python" for block in blocks(page))],
    ids=lambda page: page.name,
)
def test_python_blocks_run_and_print_what_is_shown(
    page: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "models").symlink_to(ROOT / "models")
    monkeypatch.chdir(tmp_path)
    namespace: dict[str, Any] = {"__name__": "__main__"}
    for block in blocks(page):
        if block.language != "python":
            continue
        where = f"{page.name}:{block.line}"
        printed = io.StringIO()
        with contextlib.redirect_stdout(printed):
            # Padded so that a traceback gives the line of the page.
            exec(compile("\n" * block.line + block.text, str(page), "exec"), namespace)
        shown, got = block.output or "", printed.getvalue()
        same = doctest.OutputChecker().check_output(shown, got, doctest.ELLIPSIS)
        assert same, f"{where} prints\n{got}\nbut shows\n{shown}"


@pytest.mark.skipif(shutil.which("make") is None, reason="needs make")
@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_commands_parse(page: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(ROOT)
    for line in shell_commands(page):
        check_command(line)


@pytest.mark.skipif(shutil.which("make") is None, reason="needs make")
@pytest.mark.parametrize("line", ["make sail", "make -n demo --nope", "python docs/nothing.py"])
def test_wrong_commands_are_noticed(line: str) -> None:
    with pytest.raises(AssertionError):
        check_command(line)


@pytest.mark.parametrize("line", ["hzmp-sim fly", "hzmp-sim run scene.xml --sed 3"])
def test_wrong_command_lines_are_noticed(line: str) -> None:
    with pytest.raises(pytest.fail.Exception):
        check_command(line)


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_links_lead_somewhere(page: Path) -> None:
    text = prose(page)
    for _, link, image in LINK.findall(text):
        target, _, anchor = (link or image).partition("#")
        if re.match(r"https?:|mailto:", target):
            continue
        path = page.parent / target if target else page
        assert path.exists(), f"{page.name}: {target}"
        if anchor:
            assert anchor in anchors(path), f"{page.name}: {target}#{anchor}"


def anchors(page: Path) -> set[str]:
    headings = re.findall(r"^#+ (.+)$", prose(page), re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in headings}


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_pictures_say_how_they_are_made(page: Path) -> None:
    lines = prose(page).splitlines()
    for before, line in zip(["", *lines], lines, strict=False):
        for bang, link, image in LINK.findall(line):
            if image or (bang and not link.startswith("http")):
                assert COMMENT.search(before), f"{page.name}: how is {link or image} made?"
