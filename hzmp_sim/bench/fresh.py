"""Each measurement in a process of its own: none sees the memory or the caches of another.

`FreshProcesses` starts one server (`python -m hzmp_sim.bench.fresh`) that loads the libraries once
and then forks for each task: a fork takes milliseconds where loading takes seconds. Everything
runs on one thread.
"""

from __future__ import annotations

import gc
import importlib
import json
import os
import select
import signal
import subprocess
import sys
import time
import traceback
import warnings
from contextlib import suppress
from types import TracebackType
from typing import Any, Self

from hzmp_planners.errors import HzmpError

_THREADS = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS", "VECLIB_MAXIMUM_THREADS")


class TaskError(HzmpError, RuntimeError):
    """A task raised an exception or crashed."""


class TaskTimeoutError(TaskError):
    """A task took longer than it may and was ended."""


class FreshProcesses:
    """Context manager that runs functions in fresh processes, one after the other.

        with FreshProcesses("package.module") as processes:
            answer = processes.run("package.module:function", {"argument": 1}, limit=10.0)

    Args:
        modules: what every process has imported.
    """

    def __init__(self, *modules: str) -> None:
        self._modules = modules

    def __enter__(self) -> Self:
        """Start the server.

        Raises:
            TaskError: this system cannot fork.
        """
        if not hasattr(os, "fork"):
            raise TaskError("benchmarks need a system that can fork processes: Linux or macOS")
        paths = os.pathsep.join(filter(None, sys.path))
        self._server = subprocess.Popen(
            [sys.executable, "-m", "hzmp_sim.bench.fresh", *self._modules],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            env={**os.environ, **dict.fromkeys(_THREADS, "1"), "PYTHONPATH": paths},
            start_new_session=True,  # Ctrl-C is for the caller, who ends the session on his way out
        )
        return self

    def run(self, task: str, arguments: dict[str, Any], limit: float | None = None) -> Any:
        """What a function returns, by way of JSON.

        Args:
            task: "module:function".
            arguments: keyword arguments, JSON-ready.
            limit: the process is ended after this time [s].

        Raises:
            TaskTimeoutError: it was.
            TaskError: the function raised an exception, or the process crashed.
        """
        assert self._server.stdin is not None
        assert self._server.stdout is not None
        request = {"task": task, "arguments": arguments, "limit": limit}
        try:
            self._server.stdin.write(json.dumps(request).encode() + b"\n")
            self._server.stdin.flush()
            line = self._server.stdout.readline()
        except OSError as error:
            raise TaskError(f"{task}: the measuring process ended ({error})") from error
        if not line:
            raise TaskError(f"{task}: the measuring process ended")
        reply = json.loads(line)
        if "error" in reply:
            kind = TaskTimeoutError if reply["timeout"] else TaskError
            raise kind(f"{task}: {reply['error']}")
        return reply["value"]

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """End the server and what it is doing."""
        with suppress(ProcessLookupError):
            os.killpg(self._server.pid, signal.SIGKILL)
        self._server.communicate()


def _serve() -> None:
    """Answer requests, one a line, until there are no more."""
    for module in sys.argv[1:]:
        importlib.import_module(module)
    gc.collect()
    gc.freeze()  # a collection in a fork must not copy the memory of what is loaded here
    # Python warns of forks beside other threads; here these are idle, and the child uses none.
    warnings.simplefilter("ignore", DeprecationWarning)
    for line in sys.stdin:
        request = json.loads(line)
        print(json.dumps(_reply(request)), flush=True)


def _reply(request: dict[str, Any]) -> dict[str, Any]:
    """Run a task in a forked process and wait for its answer."""
    reader, writer = os.pipe()
    child = os.fork()
    if child == 0:
        os.close(reader)
        _work(request, writer)
    os.close(writer)
    answer, ended = _read(reader, request["limit"])
    if not ended:
        os.kill(child, signal.SIGKILL)
    status = os.waitpid(child, 0)[1]
    os.close(reader)
    if not ended:
        return {"error": f"took more than {request['limit']:g} s", "timeout": True}
    if not answer:
        code = os.waitstatus_to_exitcode(status)
        return {"error": f"crashed (exit code {code})", "timeout": False}
    found: dict[str, Any] = json.loads(answer)
    return found


def _work(request: dict[str, Any], writer: int) -> None:
    """The child: run the task, write the answer, end. Libraries may print what they like."""
    silence = os.open(os.devnull, os.O_RDWR)
    for stream in (0, 1, 2):
        os.dup2(silence, stream)
    reply: dict[str, Any]
    try:
        module, name = request["task"].split(":")
        function = getattr(importlib.import_module(module), name)
        reply = {"value": function(**request["arguments"])}
        text = json.dumps(reply)
    except BaseException as error:
        where = traceback.extract_tb(error.__traceback__)[-1]
        message = f"{type(error).__name__}: {error} ({os.path.basename(where[0])}:{where[1]})"
        text = json.dumps({"error": message, "timeout": False})
    with os.fdopen(writer, "w", encoding="utf-8") as pipe:
        pipe.write(text)
    os._exit(0)


def _read(reader: int, limit: float | None) -> tuple[bytes, bool]:
    """All that comes through a pipe, and whether it came to its end in time."""
    deadline = None if limit is None else time.monotonic() + limit
    chunks: list[bytes] = []
    while True:
        left = None if deadline is None else max(deadline - time.monotonic(), 0.0)
        if not select.select([reader], [], [], left)[0]:
            return b"", False
        chunk = os.read(reader, 1 << 16)
        if not chunk:
            return b"".join(chunks), True
        chunks.append(chunk)


if __name__ == "__main__":
    _serve()
