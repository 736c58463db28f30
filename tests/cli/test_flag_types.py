from __future__ import annotations

import argparse

import pytest

from gear.cli.flag_types import not_negative, positive, workers


@pytest.mark.parametrize("text", ["0", "-1"])
def test_numbers_below_one_are_refused(text: str) -> None:
    for parse in (positive, workers):
        with pytest.raises(argparse.ArgumentTypeError, match="at least 1"):
            parse(text)


def test_a_number_of_workers_may_be_left_to_gear() -> None:
    assert (workers("3"), workers("auto"), positive("3")) == (3, "auto", 3)
    with pytest.raises(ValueError, match="auto"):
        positive("auto")


def test_numbers_that_may_be_zero() -> None:
    assert not_negative("0") == 0 and not_negative("12") == 12
    with pytest.raises(argparse.ArgumentTypeError, match="at least 0"):
        not_negative("-1")
