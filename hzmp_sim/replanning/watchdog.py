"""A stage that may fail or hang has a thread of its own; the loop does not wait for ever."""

from __future__ import annotations

import queue
import threading
import weakref
from collections.abc import Callable
from typing import Any, TypeVar

T = TypeVar("T")
_Calls = queue.SimpleQueue[Callable[[], Any] | None]
_Answers = queue.SimpleQueue[tuple[bool, Any]]


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
        self._calls: _Calls = queue.SimpleQueue()
        self._answers: _Answers = queue.SimpleQueue()
        # A thread that hangs must not keep the process from ending.
        threading.Thread(
            target=_serve, args=(self._calls, self._answers), name="planner", daemon=True
        ).start()
        # It ends with this object, and holds on to nothing of what it has computed.
        weakref.finalize(self, self._calls.put, None)

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


def _serve(calls: _Calls, answers: _Answers) -> None:
    """Compute what is called for, until there is None."""
    while (work := calls.get()) is not None:
        try:
            answers.put((True, work()))
        except Exception as error:  # whatever it is, the loop goes on
            answers.put((False, error))
        del work
