"""The command line, run in this process."""

from __future__ import annotations

import pytest

from hzmp_sim.cli import main


def exit_code(*words: str) -> int:
    """What `hzmp-sim WORDS` ends with."""
    with pytest.raises(SystemExit) as ended:
        main(words)
    assert isinstance(ended.value.code, int)
    return ended.value.code
