"""A stage that may fail or hang has a thread of its own; the loop does not wait for ever."""

from __future__ import annotations

import queue
import threading
from collections.abc import Callable
from typing import Any, TypeVar

T = TypeVar("T")


class StageError(Exception):
    """A stage has raised an exception, or did not answer."""


class Watchdog:
    """Calls in another thread, one at a time.

    The caller waits for the answer, so that what is computed does not depend on how threads run.

    Args:
        patience: how long it waits [s of the wall clock].
    """

    def __init__(self, patience: float) -> None:
        self._patience = patience
        self._calls: queue.SimpleQueue[Callable[[], Any]] = queue.SimpleQueue()
        self._answers: queue.SimpleQueue[tuple[bool, Any]] = queue.SimpleQueue()
        # A thread that hangs must not keep the process from ending.
        threading.Thread(target=self._serve, name="planner", daemon=True).start()

    def call(self, work: Callable[[], T]) -> T:
        """What `work` returns.

        Raises:
            StageError: it raised, or has not answered in time. It is not to be called again.
        """
        self._calls.put(work)
        try:
            good, answer = self._answers.get(timeout=self._patience)
        except queue.Empty:
            raise StageError(f"no answer within {self._patience:g} s") from None
        if not good:
            raise StageError(f"{type(answer).__name__}: {answer}") from answer
        result: T = answer
        return result

    def _serve(self) -> None:
        while True:
            work = self._calls.get()
            try:
                self._answers.put((True, work()))
            except Exception as error:  # whatever it is, the loop goes on
                self._answers.put((False, error))
