"""Pools: groups of datasets that are evaluated as one, such as those with the patches of one attack in different
scenes.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from gear.contracts.tasks import CONTROLS, NO_PATCH
from gear.values.errors import GearError
from gear.verbs.evaluate.compare import EvaluatedDataset, as_one, difference, mask_means, mean_cost, metrics_of
from gear.verbs.evaluate.report import Difference, Pool

Pools = Mapping[str, Sequence[str | Path]]
"""Roots of the datasets of each pool, by name of the pool."""


def check_pools(pools: Pools, roots: Iterable[Path]) -> None:
    """Checks that every pool contains only datasets of the evaluation.

    Args:
        pools: folders of the datasets of each pool, by name.
        roots: folders of all evaluated datasets.

    Raises:
        GearError: a pool is empty, contains a dataset twice, or contains a dataset that is not evaluated or is
            evaluated in several splits.
    """
    known = Counter(root.resolve() for root in roots)
    for name, members in pools.items():
        if not members:
            raise GearError(f"pool {name!r} holds no dataset")
        for root, times in Counter(Path(member).resolve() for member in members).items():
            if not known[root]:
                raise GearError(f"pool {name!r} holds {root}, which is not among the data")
            if times > 1:
                raise GearError(f"pool {name!r} holds {root} twice; give it once")
            if known[root] > 1:
                raise GearError(f"pool {name!r} holds {root}, of which several splits are among the data; evaluate one")


def pooled(rows: Sequence[EvaluatedDataset], pools: Pools, seed: int) -> Iterable[Pool]:
    """Yields the results of each pool of datasets, with the differences to the pools `none` and `random` if these
    show the same scenes.

    Args:
        rows: all evaluated datasets.
        pools: root folders of the datasets of each pool, by name of the pool.
        seed: seed of the permutation tests.
    """
    by_root = {row.dataset.root.resolve(): row for row in rows}
    found = {name: [by_root[Path(root).resolve()] for root in members] for name, members in pools.items()}
    wholes = {name: as_one(name, members) for name, members in found.items()}
    for name, members in found.items():
        one = wholes[name]
        others = [control for control in CONTROLS if control in found and control != name and name != NO_PATCH]
        yield Pool(
            name=name,
            rows=tuple(row.name for row in members),
            samples=len(one.results),
            metrics=metrics_of(one),
            cost=mean_cost(one.results),
            defense=mask_means(one.results, has_patch=name != NO_PATCH),
            differences=tuple(
                _counted(difference(one, wholes[other], seed))
                for other in others
                if _keys(found[other]) == _keys(members)
            ),
            gathered={report: one.gathered(report) for report in one.scorer.reports},
        )


def _counted(one: Difference) -> Difference:
    """Returns the difference without the list of single object changes, because its sample indices belong to
    several datasets.
    """
    return one if one.objects is None else replace(one, objects=replace(one.objects, changes=()))


def _keys(members: Sequence[EvaluatedDataset]) -> list[tuple[str, int]]:
    return [(row.dataset.plan.twin_key, len(row.results)) for row in members]
