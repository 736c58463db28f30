"""Chooses the state dict in a checkpoint that fits a network, or explains why none fits."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import torch
from torch import Tensor

from gear.contracts.specs import ModelSpec
from gear.networks.checkpoint_states import Candidate, candidates_of
from gear.networks.weights import mismatches
from gear.plugins.build import blamed
from gear.plugins.catalogue import PluginEntry
from gear.plugins.manager import DISTRIBUTION
from gear.plugins.text import printable
from gear.values.errors import GearError

LONGEST = 2000
"""Largest number of characters of an error message, because names in a checkpoint may be long."""

SHOWN = 6
"""Largest number of checkpoint entries that an error message lists."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Chosen:
    """A state dict of a checkpoint that fits the network.

    Attributes:
        name: path of the entry in the checkpoint; "" for the whole checkpoint.
        state: tensors by the network's keys.
        others: paths of further entries that also fit the network.
    """

    name: str
    state: Mapping[str, Tensor]
    others: tuple[str, ...]


def choose_state(
    plugin: PluginEntry, expected: Mapping[str, Tensor], entries: list[Candidate], path: Path, entry: str = ""
) -> Chosen:
    """Returns the first entry of a checkpoint that has exactly the keys and shapes of the network.

    Args:
        plugin: plugin of the model; its spec may translate the keys of published files.
        expected: state dict of the network.
        entries: entries of the checkpoint, the most probable first.
        path: path of the checkpoint, for messages.
        entry: path of the entry to take; "" tries all entries.

    Raises:
        GearError: no entry fits, or the named entry does not exist.
        PluginError: the function `convert` of another package's spec failed.
    """
    candidates = list(candidates_of(entries))
    if entry:
        candidates = [one for one in candidates if one.name == entry or one.entry == entry]
        if not candidates:
            raise GearError(f"{path}: has no entry {entry!r}; it holds {printable(_listed(entries), LONGEST)}")
    fitting: list[Chosen] = []
    for one in candidates:
        state = _translated(plugin, one)
        if state is None or mismatches(expected, state):
            continue
        # Two candidates may be equal after translation, because `convert` may remove the prefix.
        if not any(_same(state, known.state) for known in fitting):
            fitting.append(Chosen(name=one.name, state=state, others=()))
    if fitting:
        first, *others = fitting
        return Chosen(name=first.name, state=first.state, others=tuple(one.name for one in others))
    raise _refusal(plugin, expected, candidates, entries, path)


def _same(one: Mapping[str, Tensor], other: Mapping[str, Tensor]) -> bool:
    """Whether two state dicts of one network have equal tensors."""
    return one.keys() == other.keys() and all(torch.equal(one[key], other[key]) for key in one)


def _translated(found: PluginEntry, candidate: Candidate) -> Mapping[str, Tensor] | None:
    """Returns the state dict with the network's keys; None if the model's `convert` function cannot translate it."""
    convert = _convert_of(found)
    if convert is None:
        return candidate.state
    try:
        translated: Mapping[str, Tensor] = convert(candidate.state)
    except Exception:  # other keys were expected; `_refusal` reports the error of the best candidate
        return None
    return translated


def _refusal(
    found: PluginEntry,
    wanted: Mapping[str, Tensor],
    candidates: list[Candidate],
    entries: list[Candidate],
    path: Path,
) -> GearError:
    """Returns the error for the case that no entry fits; it describes the entry that shares most keys with the
    network.
    """

    def shared(one: Candidate) -> int:
        state = _translated(found, one)
        return 0 if state is None else len(wanted.keys() & state.keys())

    best = max(candidates, key=shared)  # among equals the first, the most probable candidate
    translated = _translated(found, best)
    if translated is None and found.owner.package != DISTRIBUTION:
        with blamed(found, "convert"):  # raises the error of the plugin's function
            translated = _convert_of(found)(best.state)
    state = best.state if translated is None else translated
    name = found.spec.name
    hints = [f"options that change the graph are given by --set; gear plugins show {name}"]
    if not wanted.keys() & state.keys():
        theirs, own = next(iter(best.state), "nothing"), next(iter(wanted), "nothing")
        hints.insert(0, f"its keys are like {theirs!r}, those of {name} like {own!r}")
    if len(entries) > 1:
        hints.insert(0, f"the file holds {_listed(entries)}")
    where = f" in {best.name!r}" if best.name else ""
    problems = "; ".join(mismatches(wanted, state))
    return GearError(printable(f"{path}: not weights of {name}{where}: {problems} ({'; '.join(hints)})", LONGEST))


def _listed(entries: list[Candidate]) -> str:
    names = [f"{one.entry or 'tensors outside of any entry'} ({len(one.state)} tensors)" for one in entries]
    return ", ".join(names[:SHOWN]) + (", …" if len(names) > SHOWN else "")


def _convert_of(found: PluginEntry) -> Any:
    assert isinstance(found.spec, ModelSpec)
    return found.spec.convert
