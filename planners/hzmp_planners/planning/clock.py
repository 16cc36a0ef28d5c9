"""The time of a query: how much was spent, how much is left, and long work in short pieces.

Work that takes long is a generator that yields whenever the time is over; it goes on from there
when there is time again.
"""

from __future__ import annotations

import gc
import math
import time
from collections.abc import Callable, Generator, Iterator
from contextlib import contextmanager
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

T = TypeVar("T")

_UNCOLLECTED = 5.0  # [s] up to which nothing is collected


class Clock:
    """A stop watch with a deadline. As it is made it stands still, and there is no deadline."""

    def __init__(self) -> None:
        self._spent = 0.0
        self._began: float | None = None
        self.deadline = math.inf
        """By `time.perf_counter` [s]."""

    def resume(self, began: float, time_limit: float) -> None:
        """Let the time run again.

        Args:
            began: since when, by `time.perf_counter` [s].
            time_limit: until the deadline [s].
        """
        self._began, self.deadline = began, began + time_limit

    def pause(self) -> None:
        """Stop the time."""
        self._spent, self._began = self.spent, None

    @property
    def spent(self) -> float:
        """How long the clock has run in all [s]."""
        return self._spent + (0.0 if self._began is None else time.perf_counter() - self._began)

    @property
    def time_left(self) -> float:
        """Time until the deadline [s]; negative when it is over."""
        return self.deadline - time.perf_counter()

    def wait_for(self, needed: float = 0.0) -> Generator[None, None, None]:
        """Yield until more time is left than the next step takes.

        Args:
            needed: what it takes [s].
        """
        while self.time_left <= needed:
            yield

    def in_pieces(
        self, work: Callable[[slice], NDArray[Any]], count: int, size: int
    ) -> Generator[None, None, NDArray[Any]]:
        """Work on rows a few at a time; a piece that would run over the deadline is not begun.

        Args:
            work: gets rows, returns an array with an entry for each of them.
            count: how many rows there are.
            size: rows of one piece; it should take a few milliseconds.

        Returns:
            What `work` returned, one after the other.
        """
        parts: list[NDArray[Any]] = []
        longest = 0.0
        for first in range(0, max(count, 1), size):
            yield from self.wait_for(longest)
            began = time.perf_counter()
            parts.append(work(slice(first, first + size)))
            longest = max(longest, time.perf_counter() - began)
        return np.concatenate(parts)


@contextmanager
def no_collection(time_limit: float) -> Iterator[None]:
    """Let no garbage collection run over a deadline.

    One of all objects takes 0.1 to 0.2 s where many modules are loaded. What is not collected
    meanwhile is little, unless it takes long.
    """
    paused = gc.isenabled() and time_limit <= _UNCOLLECTED
    if paused:
        gc.disable()
    try:
        yield
    finally:
        if paused:
            gc.enable()


def finished(work: Generator[None, None, T]) -> T:
    """What interruptible work returns, without interrupting it."""
    while True:
        try:
            next(work)
        except StopIteration as end:
            value: T = end.value
            return value
