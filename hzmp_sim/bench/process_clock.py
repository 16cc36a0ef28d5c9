"""Times of this process on a processor: what else the machine does is in none of them."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager
from unittest.mock import patch


@contextmanager
def process_clock() -> Iterator[None]:
    """Let `plan`, which reads `time.perf_counter`, take its times and its limit from that clock."""
    with patch.object(time, "perf_counter", time.process_time):
        yield
