"""Broken worlds on the command line; `python -m tests.fuzz_mjcf 300` looks at more of them."""

from fuzz_mjcf import outcomes


def test_broken_worlds_are_planned_or_refused_in_one_line() -> None:
    found = list(outcomes(range(60)))
    wrong = [f"{story}\n{outcome.complaint}" for story, outcome in found if outcome.complaint]
    assert not wrong, "\n".join(wrong)
    assert len({outcome.code for _, outcome in found}) > 1
