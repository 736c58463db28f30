"""Errors of the disk as one line."""

from __future__ import annotations

import errno
import os
from pathlib import Path

import pytest

from gear.dataset.disk_errors import HINTS, SYSTEM_LIMITS, explained
from gear.values.errors import DatasetError


@pytest.mark.parametrize("number", sorted(HINTS))
def test_a_known_error_names_the_path_and_what_to_do(number: int) -> None:
    with pytest.raises(DatasetError, match=r"out/a\.png: ") as caught, explained(Path("out/a.png")):
        raise OSError(number, os.strerror(number))
    assert HINTS[number] in str(caught.value)
    assert "\n" not in str(caught.value)


def test_an_unknown_error_keeps_its_own_text() -> None:
    with pytest.raises(DatasetError, match="out: Input/output error"), explained(Path("out")):
        raise OSError(errno.EIO, os.strerror(errno.EIO))
    with pytest.raises(DatasetError, match="out: strange"), explained(Path("out")):
        raise OSError("strange")


@pytest.mark.parametrize("number", sorted(SYSTEM_LIMITS))
def test_limits_of_the_machine_are_passed_on(number: int) -> None:
    with pytest.raises(OSError) as caught, explained(Path("out")):
        raise OSError(number, "")
    assert not isinstance(caught.value, DatasetError)
