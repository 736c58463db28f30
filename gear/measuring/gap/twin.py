"""Collects the twin of a clean split: the same scenes rendered with a patch, from the config in the manifest."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import yaml

from gear.collecting.job import resolve
from gear.collecting.run import run_job
from gear.config.collection import CollectionConfig
from gear.config.nodes import Place, in_one_place, parse_text
from gear.config.reader import read_node
from gear.contracts.tasks import NO_PATCH
from gear.dataset.plan import read_plan
from gear.dataset.reading import Dataset
from gear.dataset.store import Store
from gear.values.errors import ConfigError, DatasetError, UnknownNameError


def check_clean(clean: Dataset[Any]) -> None:
    """Checks that the split `clean` was rendered without a patch.

    Raises:
        DatasetError: the split shows a patch.
    """
    label = clean.plan.patch["label"]
    if label != NO_PATCH:
        raise DatasetError(clean.root, f"shows the patch {label} itself; name a dataset collected with --patch none")


def collect_twin(
    clean: Dataset[Any],
    patch: str | Path,
    root: Path,
    *,
    samples: int | None = None,
    town: str | Path | None = None,
    scenes: str | Path | None = None,
) -> None:
    """Renders the scenes of a clean split with a patch, into a new dataset; an existing dataset is completed.

    Args:
        clean: the split without a patch.
        patch: the patch, as a value of `--patch`.
        root: root of the dataset with the patch.
        samples: number of samples from the first one on, rounded up to whole sequences; all by default.
        town, scenes: paths of the town and of its scene library (`FILE`, or `FILE:SCENE`). They are needed for a town
            that does not come with gear, because a dataset records no paths of the machine that made it.

    Raises:
        PatchError: the patch cannot be used.
        DatasetError: the same scenes cannot be made with these files and versions.
    """
    wanted = clean.plan.samples if samples is None else min(samples, clean.plan.samples)
    there = read_plan(root, clean.plan.info.split)
    if there is not None:
        wanted = max(wanted, there.samples)
    if not isinstance(clean.manifest.get("config"), dict):
        raise DatasetError(clean.root, "has a manifest without the config that it was collected with; give --twin DIR")
    config: dict[str, Any] = {
        **clean.manifest["config"],
        "town": str(town or clean.content(str, "town")),
        "samples": -(-wanted // max(clean.content(int, "frames"), 1)),
        "patch": str(patch),
        "root": str(root),
        "probes": False,
        # As `gear collect --scene` is given it: the library's file and the scene in it.
        **({"scenes": str(scenes).removesuffix(f":{clean.plan.info.scene}")} if scenes else {}),
    }
    remedy = f"collect the twin yourself, as the dataset was but with --patch {patch}, and name it with --twin DIR"
    try:
        name = f"{clean.root} manifest"
        node = in_one_place(parse_text(yaml.safe_dump(config, sort_keys=False), name), Place(name))
        job = resolve(read_node(CollectionConfig, node))
    except (UnknownNameError, ConfigError) as error:
        files = "" if town and scenes else "say where its town and scene library lie with --town and --scenes, or "
        raise DatasetError(clean.root, f"cannot be collected again ({error}); {files}{remedy}") from error
    if job.plan.twin_key != clean.plan.twin_key:
        raise DatasetError(clean.root, f"this gear would not make the same scenes again; {remedy}")
    surfaces, patches = len(clean.sidecar(0).record.surfaces), len(job.patch.images)
    if patches < surfaces:
        raise DatasetError(clean.root, f"has {surfaces} surfaces for patches, {patch} has {patches}; give one for each")
    if there is not None and there.patch != job.plan.patch and Store(root, there).missing() != [*range(there.samples)]:
        raise DatasetError(
            root, f"is another gap's twin, with the patch {there.patch['label']}; use another --out, or remove it"
        )
    run_job(job)
