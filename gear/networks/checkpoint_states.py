"""Finds the weights of a network in the file of a training checkpoint.

Training code wraps networks: `DataParallel` puts `module.` before every key, `torch.compile` puts `_orig_mod.`, a
LightningModule puts the name of its attribute. Training code also saves several states in one file (`model` and `ema`,
or `state_dict` in `checkpoint`). This module cannot know all such names. It therefore proposes candidates: every entry
of the file, and every prefix that many keys of an entry share. The caller takes the candidate whose keys fit the
network.
"""

from __future__ import annotations

from collections import Counter, deque
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from torch import Tensor

from gear.values.errors import GearError

STATES = ("model", "state_dict", "model_state_dict", "model_state", "net", "network", "weights", "params", "checkpoint")
"""Usual names of the checkpoint entry that holds the network's tensors, the most likely name first."""

AVERAGED = ("ema", "avg", "average", "swa", "teacher")
"""Words that mark an entry or prefix as averaged weights (EMA, SWA) or a teacher network, not the trained network."""

DEPTH = 4
"""Largest number of nested levels that are searched for tensors, and largest number of dot-separated parts of a
prefix.
"""

LEAST_SHARE = 0.2
"""Smallest share of an entry's keys that must start with a prefix; only such prefixes are tried."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Candidate:
    """Tensors of one checkpoint entry that may be a network's weights, with a prefix removed from their keys.

    Attributes:
        entry: path of the entry in the checkpoint, such as `checkpoint.model`; "" for the file's outermost mapping.
        prefix: text that was removed from the start of every key, such as `module.`; "" for nothing.
        state: tensors by key, without the prefix.
        left_out: names of the entry's tensors whose keys do not start with the prefix.
    """

    entry: str
    prefix: str
    state: Mapping[str, Tensor]
    left_out: tuple[str, ...] = ()

    @property
    def name(self) -> str:
        """Entry and prefix as one path, such as `checkpoint.model.module`; users select a candidate by this name.
        "" for the whole file.
        """
        return ".".join(part for part in (self.entry, self.prefix.rstrip(".")) if part)


def entries_of(content: Any, path: Path) -> list[Candidate]:
    """The mappings in a checkpoint that hold tensors, the most likely network first. Keys are unchanged; no prefix
    is removed.

    Args:
        content: content of the checkpoint, as torch reads it.
        path: path of the checkpoint, for the message.

    Raises:
        GearError: the checkpoint holds no tensors.
    """
    if not isinstance(content, Mapping):
        raise GearError(f"{path}: holds no network, but a {type(content).__name__}; a state dict is wanted")
    found: list[Candidate] = []
    waiting: deque[tuple[tuple[str, ...], Mapping[Any, Any]]] = deque([((), content)])
    while waiting:
        names, mapping = waiting.popleft()
        tensors = {str(key): value for key, value in mapping.items() if isinstance(value, Tensor)}
        if tensors:
            found.append(Candidate(entry=".".join(names), prefix="", state=tensors))
        if len(names) < DEPTH:
            nested = ((key, one) for key, one in mapping.items() if isinstance(key, str) and isinstance(one, Mapping))
            waiting.extend(((*names, key), one) for key, one in nested)
    if not found:
        keys = ", ".join(map(str, list(content)[:5])) or "nothing"
        raise GearError(f"{path}: holds no network's tensors (but {keys}); a state dict is wanted")
    return sorted(found, key=lambda one: _unlikeliness(one.entry))


def candidates_of(entries: list[Candidate]) -> Iterator[Candidate]:
    """Yields the candidates for a network's weights: every entry with unchanged keys, then the entry again without
    each prefix that many of its keys share.

    Args:
        entries: result of `entries_of`, the most likely network first.
    """
    for one in entries:
        yield one
        counts: Counter[str] = Counter()
        for key in one.state:
            parts = key.split(".")[:-1][:DEPTH]
            counts.update(".".join(parts[: number + 1]) + "." for number in range(len(parts)))
        least = LEAST_SHARE * len(one.state)
        shared = sorted((prefix for prefix, count in counts.items() if count >= least), key=_prefix_order)
        for prefix in shared:
            state = {key.removeprefix(prefix): one.state[key] for key in one.state if key.startswith(prefix)}
            rest = tuple(key for key in one.state if not key.startswith(prefix))
            yield Candidate(entry=one.entry, prefix=prefix, state=state, left_out=rest)


def _prefix_order(prefix: str) -> tuple[bool, int]:
    """Sort key of prefixes: short ones first, those of averaged weights last."""
    return _is_averaged(prefix), prefix.count(".")


def _unlikeliness(entry: str) -> tuple[int, int, int]:
    """Sort key of entries: usual names, then others, then averaged weights, then states of an optimiser."""
    names = entry.split(".") if entry else []
    if any(name.lower().startswith("optim") for name in names):
        rank = 3
    elif any(_is_averaged(name) for name in names):
        rank = 2
    elif names and all(name in STATES for name in names):
        rank = 0
    else:
        rank = 1
    return rank, STATES.index(names[0]) if rank == 0 else len(STATES), len(names)


def _is_averaged(name: str) -> bool:
    return any(word in name.lower().replace(".", "_").split("_") for word in AVERAGED)
