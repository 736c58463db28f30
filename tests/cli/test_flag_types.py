from __future__ import annotations

import argparse

import pytest

from gear.cli.flag_types import positive, workers


@pytest.mark.parametrize("text", ["0", "-1"])
def test_numbers_below_one_are_refused(text: str) -> None:
    for parse in (positive, workers):
        with pytest.raises(argparse.ArgumentTypeError, match="at least 1"):
            parse(text)


def test_a_number_of_workers_may_be_left_to_gear() -> None:
    assert (workers("3"), workers("auto"), positive("3")) == (3, "auto", 3)
    with pytest.raises(ValueError, match="auto"):
        positive("auto")
