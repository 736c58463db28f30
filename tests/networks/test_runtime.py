from __future__ import annotations

import subprocess
import sys

import pytest
import torch

from gear.networks.runtime import as_bytes, autocast, seeded
from gear.values.errors import GearError


@pytest.mark.parametrize(("before", "after"), [(1, 1), (64, None)])
def test_threads_set_before_are_kept_and_never_more_than_cores(before: int, after: int | None) -> None:
    code = (
        f"import os, torch; torch.set_num_threads({before})\n"
        f"from gear.networks.runtime import prepare; prepare()\n"
        "print(torch.get_num_threads(), len(os.sched_getaffinity(0)) if hasattr(os, 'sched_getaffinity') else 0)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    threads, cores = map(int, done.stdout.split())
    assert threads == after if after is not None else threads == (cores or threads)


def test_precision_is_half_only_where_asked_for() -> None:
    a = torch.randn(4, 4)
    with autocast(torch.device("cpu"), "float32"):
        assert (a @ a).dtype == torch.float32
    with autocast(torch.device("cpu"), "bfloat16"):
        assert (a @ a).dtype == torch.bfloat16


def test_a_seed_that_torch_does_not_have_is_said() -> None:
    with seeded(2**64 - 1):
        pass
    with pytest.raises(GearError, match="seed 18446744073709551616 is beyond what torch takes"), seeded(2**64):
        pass


def test_pictures_are_rounded_to_bytes_and_clipped() -> None:
    picture = torch.tensor([-1.0, 0.0, 0.4 / 255, 0.6 / 255, 1.0, 2.0]).reshape(3, 1, 2)
    rounded = [[[0, 0, 255], [0, 1, 255]]]
    assert as_bytes(picture).tolist() == rounded
    batch = as_bytes(torch.stack([1 - picture, picture]).requires_grad_(True))
    assert batch.shape == (2, 1, 2, 3) and batch.flags.c_contiguous and batch[1].tolist() == rounded
