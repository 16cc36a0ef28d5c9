"""Tables that are printed on the terminal and written as Markdown."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

from rich.table import Table as RichTable
from rich.text import Text

from hzmp_sim.console import wide_console

_PIPED_WIDTH = 160  # columns of a table that no terminal sizes


@dataclass(frozen=True)
class Table:
    """Rows of text under a heading."""

    title: str
    columns: Sequence[str]
    rows: Sequence[Sequence[str]]
    note: str = ""
    """A sentence or two below the heading: how to read it."""
    remarks: Sequence[str] = ()
    """Lines below the table: what is not in it."""

    def markdown(self, level: int = 2) -> str:
        """As Markdown, under a heading of a level."""
        lines = [f"{'#' * level} {self.title}", ""]
        if self.note:
            lines += [self.note, ""]
        if self.rows:
            lines.append("| " + " | ".join(self.columns) + " |")
            lines.append("|---" * len(self.columns) + "|")
            lines += ["| " + " | ".join(row) + " |" for row in self.rows]
        if self.rows and self.remarks:
            lines.append("")
        lines += [f"- {remark}" for remark in self.remarks]
        return "\n".join(lines) + "\n"


def print_results(tables: Sequence[Table], files: Iterable[Path]) -> None:
    """Print the tables of a benchmark, and which files it wrote."""
    print_tables(tables)
    print("files     " + "\n          ".join(str(file) for file in files))


def print_tables(tables: Sequence[Table]) -> None:
    """Print tables to stdout, numbers to the right."""
    console = wide_console(_PIPED_WIDTH)
    for table in tables:
        console.print(Text(table.title, style="bold"))
        if table.note:
            console.print(Text(table.note, style="dim"))
        shown = RichTable(box=None, pad_edge=False)
        for number, column in enumerate(table.columns):
            shown.add_column(column, justify="left" if number == 0 else "right")
        for row in table.rows:
            shown.add_row(*(Text(cell, style=_STYLES.get(cell, "")) for cell in row))
        if table.rows:
            console.print(shown)
        for remark in table.remarks:
            console.print(Text(remark))
        console.print()


_STYLES = {"met": "green", "missed": "bold red"}


def short(value: float | None, digits: int = 3) -> str:
    """A number with so many significant digits, thousands grouped; a dash for none."""
    if value is None:
        return "-"
    if value == 0.0:
        return "0"
    if abs(value) >= 10.0 ** (digits - 1):
        return f"{value:,.0f}"
    return f"{value:.{digits}g}"


def seconds(value: float | None) -> str:
    """A time [s] in the unit that suits it."""
    if value is None:
        return "-"
    if value < 1e-3:
        return f"{short(1e6 * value)} us"
    return f"{short(1e3 * value)} ms" if value < 1.0 else f"{short(value)} s"


def percent(ratio: float | None) -> str:
    """A ratio in percent."""
    return "-" if ratio is None else f"{short(100.0 * ratio, 2)} %"
