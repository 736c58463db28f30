"""Checks the existing samples of a split before a run adds the missing ones."""

from __future__ import annotations

from functools import partial

from gear.dataset.files import inside
from gear.dataset.guarded_paths import remove_files
from gear.dataset.hashing import file_hash, in_threads
from gear.dataset.layout import sidecar_path
from gear.dataset.sealed_json import REPAIR, DamagedError
from gear.dataset.sharding.shards import WHOLE, Shard
from gear.dataset.sidecar import read_sidecar
from gear.dataset.store import Store
from gear.values.progress import NO_CALLBACKS, Progress


def refuse_damaged(store: Store, shard: Shard = WHOLE, on_progress: Progress = NO_CALLBACKS.on_progress) -> None:
    """Checks all files of a shard's existing samples against the hashes in their sidecars (JSON files of the samples).

    If a file of a sample is missing, the sidecar is deleted, so the sample is made again. A changed file is not
    overwritten, because the user may have edited it.

    Args:
        store: the split.
        shard: the part of the split that is checked.
        on_progress: called after every sample with the numbers of checked and of existing samples.

    Raises:
        DamagedError: a file has other bytes than those that were written.
    """
    missing = set(store.missing(shard))
    indices = [index for index in store.indices(shard) if index not in missing]
    incomplete: list[str] = []
    changed: list[str] = []
    damages = in_threads(partial(_damage_of, store), indices)
    for done, (index, (lacking, different)) in enumerate(zip(indices, damages, strict=True), start=1):
        if lacking:
            incomplete.append(sidecar_path(store.split, index))
        changed += different
        on_progress(done, len(indices))
    if changed:
        more = f" (and {len(changed) - 1} more)" if len(changed) > 1 else ""
        raise DamagedError(inside(store.root, changed[0]), f"is not as it was written{more}; {REPAIR}")
    remove_files(store.root, incomplete)


def _damage_of(store: Store, index: int) -> tuple[list[str], list[str]]:
    """The missing files of a sample, and the files whose hash is not that in its sidecar."""
    path = inside(store.root, sidecar_path(store.split, index))
    hashes = read_sidecar(path).files
    lacking = [relative for relative in hashes if not inside(store.root, relative).is_file()]
    there = hashes.keys() - set(lacking)
    return lacking, sorted(name for name in there if file_hash(inside(store.root, name)) != hashes[name])
