"""How much of a dataset's pictures each Cityscapes class takes.

    python benchmarks/shares.py data/semseg …

Printed are, for every class that is trained on, its share of the pixels that have such a class, in percent, and the
share of the pictures that show it: for each town, and for all datasets together.
"""

from __future__ import annotations

import argparse
from collections import defaultdict
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

import gear
from gear.metrics.semantic import COUNT, EVALUATED


@dataclass
class Counts:
    """What several pictures show.

    Attributes:
        pixels: of each label id.
        seen: pictures in which each label id is.
        pictures: how many there are.
    """

    pixels: npt.NDArray[np.int64] = field(default_factory=lambda: np.zeros(COUNT, np.int64))
    seen: npt.NDArray[np.int64] = field(default_factory=lambda: np.zeros(COUNT, np.int64))
    pictures: int = 0

    def add(self, label_ids: npt.NDArray[np.uint8]) -> None:
        """One more picture."""
        here = np.bincount(label_ids.ravel(), minlength=COUNT)[:COUNT]
        self.pixels += here
        self.seen += here > 0
        self.pictures += 1


def main() -> None:
    """Prints one line a class."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("data", nargs="+")
    args = parser.parse_args()
    found: dict[str, Counts] = defaultdict(Counts)
    for root in args.data:
        dataset = gear.open_dataset(root)
        for sample in dataset:
            for name in (dataset.plan.info.town, "all"):
                found[name].add(sample.label_ids)
    found["all"] = found.pop("all")
    print(f"{'class':15}" + "".join(f"{name + f' ({counts.pictures})':>22}" for name, counts in found.items()))
    for label in EVALUATED:
        print(f"{label.name:15}" + "".join(f"{_cell(counts, label.id):>22}" for counts in found.values()))


def _cell(counts: Counts, label_id: int) -> str:
    labelled = counts.pixels[[label.id for label in EVALUATED]].sum()
    return f"{100 * counts.pixels[label_id] / labelled:.3f} in {100 * counts.seen[label_id] / counts.pictures:.0f} %"


if __name__ == "__main__":
    main()
