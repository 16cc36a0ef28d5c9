"""Signs of life from whatever takes longer than a second, silent when nobody watches."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

DELAY_S = 1.0
"""Work that ends sooner than this shows no bar [s]: a flash on the screen tells nothing."""


@contextmanager
def progress(
    description: str, total: float, *, console: Console | None = None
) -> Iterator[Callable[[float], None]]:
    """Bar on stderr while the block runs; yields `advance(amount)`.

    The bar appears when stderr is a terminal and the work has taken more than a second. It is
    removed when the block ends, also by an exception or Ctrl-C.

    Args:
        description: what is going on, e.g. "Rendering".
        total: sum of all amounts that `advance` will be given.
        console: where to draw; stderr when None.
    """
    screen = console or Console(stderr=True)
    bar = Progress(
        TextColumn("{task.description}"),
        BarColumn(),
        TextColumn("{task.percentage:>3.0f} %"),
        TimeRemainingColumn(),
        console=screen,
        transient=True,
    )
    task = bar.add_task(description, total=total)
    begin = time.monotonic()
    shown = False

    def advance(amount: float = 1.0) -> None:
        nonlocal shown
        bar.advance(task, amount)
        if not shown and screen.is_terminal and time.monotonic() - begin > DELAY_S:
            bar.start()
            shown = True

    try:
        yield advance
    finally:
        if shown:
            bar.stop()


@contextmanager
def busy(description: str, *, console: Console | None = None) -> Iterator[None]:
    """Spinner on stderr while the block runs, for work that cannot say how far it is.

    It appears when stderr is a terminal and the work has taken more than a second.

    Args:
        description: what is going on, e.g. "Planning".
        console: where to draw; stderr when None.
    """
    screen = console or Console(stderr=True)
    if not screen.is_terminal:
        yield
        return
    spinner = screen.status(description)
    timer = threading.Timer(DELAY_S, spinner.start)
    timer.daemon = True
    timer.start()
    try:
        yield
    finally:
        timer.cancel()
        timer.join()
        spinner.stop()
