"""COCO's compressed run lengths, against pycocotools."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pycocotools import mask as coco_mask

from gear.values.run_lengths import run_lengths


@settings(max_examples=60, deadline=None)
@given(st.integers(1, 40), st.integers(1, 40), st.integers(0, 2**32 - 1), st.floats(0.02, 0.98))
def test_lengths_are_those_of_the_columns(height: int, width: int, seed: int, share: float) -> None:
    mask = np.random.default_rng(seed).random((height, width)) < share
    text = coco_mask.encode(np.asfortranarray(mask.astype(np.uint8)))["counts"].decode()
    lengths = run_lengths(text)
    values = np.repeat(np.arange(len(lengths)) % 2, lengths)
    assert np.array_equal(values.reshape(width, height).T.astype(bool), mask)


@pytest.mark.parametrize("text", ["é", "\x1f", "P", "o" * 9 + "0"])
def test_other_strings_are_refused(text: str) -> None:
    with pytest.raises(ValueError):
        run_lengths(text)


def test_an_empty_string_has_no_runs() -> None:
    assert run_lengths("").size == 0
