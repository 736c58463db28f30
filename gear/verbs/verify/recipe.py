"""Reconstructs the collection job that made a split from the recorded plan or manifest of the split."""

from __future__ import annotations

import dataclasses
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import yaml

from gear.collecting.job import Job, resolve
from gear.collecting.patch_sources import resolve_patch
from gear.config.collection import CollectionConfig
from gear.config.nodes import Place, in_one_place, parse_text
from gear.config.reader import read_node
from gear.contracts.tasks import NO_PATCH, RANDOM_PATCH
from gear.dataset.checks.verification import SplitCheck
from gear.dataset.files import inside
from gear.dataset.guarded_paths import parts_of
from gear.dataset.layout import patch_path
from gear.dataset.plan import differences
from gear.networks.shipped import shipped_patches
from gear.values.errors import BackendError, ConfigError, DatasetError, PatchError, UnknownNameError
from gear.values.serial import Json
from gear.verbs.verify.salvaged_recipe import salvaged_recipe

HASH = 1 + 8
"""Number of characters at the end of a patch's label: a hyphen and the hash."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Sources:
    """Files that a dataset needs for a repair but does not name, because their paths depend on the machine.

    Attributes:
        patch: the patch in the pictures, if the dataset's copy of the patch is damaged; otherwise None.
        town: MJCF file of the town, if the town is not part of gear; otherwise None.
        scenes: scene library of that town.
        simulation: simulation config, if it is not part of gear; otherwise None.
    """

    patch: str | Path | None = None
    town: str | Path | None = None
    scenes: str | Path | None = None
    simulation: str | Path | None = None


def job_of(root: Path, check: SplitCheck, sources: Sources) -> Job:
    """Returns the collection job that made a split, so the split can be rendered again.

    Args:
        root: root of the dataset.
        check: result of the check of the split.
        sources: files that the dataset does not name.

    Raises:
        DatasetError: neither plan nor manifest records how the split was made, or identical files cannot be made on
            this machine.
    """
    if check.plan is None and not isinstance(check.manifest, dict):
        return _salvaged_job(root, check, sources)
    known = _known(root, check)
    job = _resolved(root, check, known, sources)
    if job.plan.content_key != known["content_key"]:
        what = ", ".join(differences(check.plan.as_json(), job.plan.as_json())[:2]) if check.plan is not None else ""
        raise _other_bytes(root, check, what or "other versions, renderer or files")
    return job


def _other_bytes(root: Path, check: SplitCheck, why: str) -> DatasetError:
    problem = f"split {check.split!r} would differ if it were made on this machine ({why})"
    return DatasetError(root, f"{problem}; repair it on the machine and with the versions with which it was made")


def _salvaged_job(root: Path, check: SplitCheck, sources: Sources) -> Job:
    """Returns the job of a split of which both plan and manifest are damaged or missing.

    Raises:
        DatasetError: the two files do not say how the split was made, or identical files cannot be made on this
            machine.
    """
    salvaged = salvaged_recipe(root, check.split, check.samples)
    refusal = DatasetError(root, _unknown(check))
    for candidate in salvaged.candidates:
        try:
            job = _resolved(root, check, candidate, sources)
        except DatasetError as error:
            refusal = DatasetError(root, f"the plan and the manifest are damaged: {error.problem}; or {_REMEDY}")
            continue
        if salvaged.is_proven(job.plan):
            return job
        refusal = _other_bytes(root, check, "values lost in the damaged plan, other versions, renderer or files")
    raise refusal


def _resolved(root: Path, check: SplitCheck, known: dict[str, Json], sources: Sources) -> Job:
    """Returns the job of the recorded values, with the recorded recipe in its plan.

    Args:
        root: root of the dataset.
        check: result of the check of the split.
        known: recorded values, with the keys `recipe`, `town`, `seed`, `patch`, `samples` and `frames`.
        sources: files that the dataset does not name.

    Raises:
        DatasetError: a value is wrong, or names a file that is not here.
    """
    with _patch_folder(root, check, known, sources) as patch:
        config: dict[str, Any] = {
            **known["recipe"],
            "town": str(sources.town or known["town"]),
            "seed": known["seed"],
            "samples": known["samples"] // known["frames"],
            "patch": patch,
            "root": str(root),
            **({"scenes": str(sources.scenes)} if sources.scenes else {}),
            **({"simulation": str(sources.simulation)} if sources.simulation else {}),
        }
        try:
            name = f"{root} split {check.split}"
            node = in_one_place(parse_text(yaml.safe_dump(config, sort_keys=False), name), Place(name))
            job = resolve(read_node(CollectionConfig, node))
        except (UnknownNameError, ConfigError, PatchError, BackendError) as error:
            advice = "name files of your own with --town, --scenes and --simulation"
            raise DatasetError(root, f"split {check.split!r} cannot be made again ({error}); {advice}") from error
    return dataclasses.replace(job, plan=dataclasses.replace(job.plan, recipe=known["recipe"]))


_REMEDY = "delete both files and run the same `gear collect` again, which keeps whole samples"


def _unknown(check: SplitCheck) -> str:
    return f"neither the plan nor the manifest of split {check.split!r} says how it was made; {_REMEDY}"


def _known(root: Path, check: SplitCheck) -> dict[str, Json]:
    """Returns how a split was made, from its plan, or from its manifest if the plan is damaged.

    Raises:
        DatasetError: neither file records how the split was made.
    """
    plan, manifest = check.plan, check.manifest if isinstance(check.manifest, dict) else {}
    recipe = (plan.recipe if plan is not None else None) or manifest.get("config")
    try:
        if not isinstance(recipe, dict):
            raise KeyError("config")
        if plan is not None:
            return {
                "recipe": recipe, "town": plan.content["town"], "seed": plan.content["seed"], "patch": plan.patch,
                "samples": plan.samples, "frames": max(plan.content["frames"], 1), "content_key": plan.content_key,
            }  # fmt: skip
        frames = 1 + max((one["frame"] for one in manifest["samples"]), default=0)
        return {
            "recipe": recipe, "town": manifest["info"]["town"], "seed": manifest["seed"], "patch": manifest["patch"],
            "samples": len(manifest["samples"]), "frames": frames, "content_key": manifest["content_key"],
        }  # fmt: skip
    except (KeyError, TypeError) as error:
        raise DatasetError(root, _unknown(check)) from error


@contextmanager
def _patch_folder(root: Path, check: SplitCheck, known: dict[str, Json], sources: Sources) -> Iterator[str]:
    """Yields the value of `--patch` for a split: `none`, `random`, or a temporary folder with the patch under its
    own name.

    Raises:
        DatasetError: the dataset's copy of the patch is damaged and no patch was given, or another patch was given.
    """
    label, digest = known["patch"]["label"], known["patch"]["sha256"]
    if label in (NO_PATCH, RANDOM_PATCH):
        yield label
        return
    parts_of(root, patch_path(label, "patch_0.png"))
    copies = inside(root, patch_path(label, "patch_0.png")).parent
    name = label[:-HASH]
    count = max(len(check.manifest.get("patches", {})) if isinstance(check.manifest, dict) else 0, 1)
    for source in (sources.patch, copies, shipped_patches().get(name)):
        if source is None:
            continue
        try:
            found = resolve_patch(str(source), surfaces=count, seed=0)
        except PatchError:
            continue
        if found.digest == digest:
            with tempfile.TemporaryDirectory(prefix="gear-") as scratch:
                folder = Path(scratch) / name
                folder.mkdir()
                for file, data in found.files.items():
                    (folder / file).write_bytes(data)
                yield str(folder)
            return
    problem = f"the copy of patch {label} is damaged; name the patch with --patch"
    raise DatasetError(root, f"split {check.split!r} cannot be made again: {problem}")
