"""Pages of results: Markdown that says which command made it, and the pages in docs/."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path

from hzmp_sim.bench.tables import Table

_MADE = "<!-- made by: "


def page_text(
    command: str,
    introduction: str,
    tables: Iterable[Table],
    figures: Sequence[str],
    captions: Mapping[str, str] | None = None,
) -> str:
    """What was measured, its tables and its pictures, as Markdown.

    Args:
        command: makes this text.
        introduction: what was measured on which machine.
        tables: of the results.
        figures: paths of pictures, as they are to be linked.
        captions: what some of them show, by how their paths end: text beneath them.
    """
    made = f"{_MADE}{command} -->"
    lines = [made, f"{introduction}\n", *(table.markdown() for table in tables)]
    for figure in figures:
        lines += [f"{made}\n![{Path(figure).name.split('.')[0]}]({figure})\n"]
        lines += [f"{text}\n" for end, text in (captions or {}).items() if figure.endswith(end)]
    return "\n".join(lines)


def update_page(
    page: Path,
    write_figures: Callable[[Path], list[Path]],
    text: Callable[[Sequence[str]], str],
) -> None:
    """Write the generated part of a page; what stands above it is kept.

    Args:
        page: Markdown file.
        write_figures: writes the figures to a folder and returns their paths.
        text: the generated part, for links to the figures.
    """
    figures = write_figures(page.parent / "images")
    links = [figure.relative_to(page.parent).as_posix() for figure in figures]
    head = page.read_text(encoding="utf-8").partition(_MADE)[0]
    page.write_text(head + text(links), encoding="utf-8")
