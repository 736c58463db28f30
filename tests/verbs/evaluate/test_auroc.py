"""The area under the ROC curve: as every pair says it, without a table of all pairs."""

from __future__ import annotations

import tracemalloc

import numpy as np
import pytest

from gear.measuring.intervals import Values, jackknife_interval
from gear.measuring.statistics import auroc, auroc_interval
from gear.values.rng import derive_rng


def by_pairs(positives: Values, negatives: Values) -> float:
    above = positives[:, None] - negatives[None]
    return float((above > 0).mean() + 0.5 * (above == 0).mean())


def test_it_is_how_often_a_positive_is_above() -> None:
    assert auroc([0.9, 0.8], [0.1, 0.2]) == 1 and auroc([0.1], [0.5]) == 0 and auroc([0.5], [0.5]) == 0.5
    assert auroc([0.3, 0.7], [0.3, 0.5]) == (0.5 + 0 + 1 + 1) / 4
    assert np.isnan(auroc([], [0.5])) and np.isnan(auroc([0.5], []))


@pytest.mark.parametrize("decimals", [1, 2, 16])
@pytest.mark.parametrize("counts", [(1, 1), (3, 7), (24, 24), (101, 97)])
def test_it_is_what_all_pairs_say_to_the_last_bit(counts: tuple[int, int], decimals: int) -> None:
    rng = derive_rng(0, "auroc", *counts)
    high, low = (np.round(rng.random(count), decimals) for count in counts)
    assert auroc(high, low) == by_pairs(high, low)
    count = min(counts)
    high, low = high[:count], low[:count]
    area = auroc(high, low)
    if count > 1 and area not in (0, 1):
        without = np.array([by_pairs(np.delete(high, one), np.delete(low, one)) for one in range(count)])
        assert auroc_interval(high, low, range(count)) == jackknife_interval(area, without, (0, 1), lost_degrees=1)


def test_many_samples_take_no_table_of_their_pairs() -> None:
    rng = derive_rng(0, "auroc")
    high, low = rng.random(4000), rng.random(4000)
    tracemalloc.start()
    auroc(high, low)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 1 << 20
