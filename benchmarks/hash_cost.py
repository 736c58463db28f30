"""Measures what checking hashes adds to reading a sample: `python benchmarks/hash_cost.py DATASET ...`."""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path

import gear
from gear.dataset.reading import check_hash

TRIES = 5


def milliseconds(call: Callable[[], object]) -> float:
    """Shortest processor time of `TRIES` calls, milliseconds."""
    best = float("inf")
    for _ in range(TRIES):
        start = time.process_time()
        call()
        best = min(best, time.process_time() - start)
    return best * 1e3


def check_all(root: Path, files: dict[str, str]) -> None:
    """Checks the files of a sample."""
    for path, digest in files.items():
        check_hash(root, path, digest)


def main() -> None:
    """Prints one line for each dataset."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("datasets", nargs="+", metavar="DATASET")
    for root in parser.parse_args().datasets:
        dataset = gear.open_dataset(root)
        sidecar = dataset.sidecar(0)
        auxiliary = {file.path for file in sidecar.auxiliary.values()}
        files = {path: digest for path, digest in sidecar.files.items() if path not in auxiliary}
        size = sum((dataset.root / path).stat().st_size for path in files) / 1e6
        sample = milliseconds(partial(dataset.__getitem__, 0))
        hashes = milliseconds(partial(check_all, dataset.root, files))
        print(f"{root}: {sample:.1f} ms per sample, of which {hashes:.1f} ms for hashes of {size:.1f} MB")


if __name__ == "__main__":
    main()
