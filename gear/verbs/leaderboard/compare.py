"""Compares a record with this machine: plugins, repeated samples, fresh samples, and pictures of withheld scenes."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from gear.leaderboard.record import Record
from gear.leaderboard.rules import NONE, RANDOM
from gear.leaderboard.verdict import Finding, Level, finding
from gear.measuring.statistics import paired_p
from gear.values.rng import derive_rng
from gear.verbs.leaderboard.rerun import Again, Rerun

DECIDING = ("gear", "mujoco", "numpy", "opencv", "torch", "machine", "device")
"""Entries of the environment that decide the bytes of pictures and predictions, beside those of the renderer."""

MOST_OFF, MOST_MEAN_OFF = 0.1, 0.02
"""Largest differences of a sample's metric, and of the mean over samples, between machines that differ; relative for
values above 1."""

LEAST_P = 0.01
"""Probability below which fresh pictures are not of the same kind as those of the benchmark; it is divided by the
number of tests (Bonferroni)."""

DRAWS = 9_999

MOST_NUMBERS = 2_000_000
"""Largest number of values that the permutation test shuffles at a time, which bounds its memory."""


def is_same_machine(record: Record, environment: Mapping[str, str]) -> bool:
    """Whether this machine should give the same bytes as the machine of the record: same versions, renderer, driver and
    device.

    Args:
        record: the record.
        environment: values of this machine, by the same keys as `record.environment`.
    """
    keys = [key for key in record.environment if key in DECIDING or key.startswith("renderer.")]
    return all(record.environment[key] == environment.get(key) for key in keys)


def compare_plugins(rerun: Rerun) -> Iterator[Finding]:
    """Yields one finding for each fact in which the installed plugins differ from those of the record.

    Args:
        rerun: the record with the plugins that are installed here.
    """
    for role, there, here in rerun.installed():
        if there.identity[:2] != here.identity[:2] or there.options != here.options:
            yield finding("differs", f"{role}: {there.name} in the record, but its config names {here.name} otherwise")
        elif there.version != here.version:
            yield finding("note", f"{role}: version {there.version} in the record, {here.version} is installed")
        elif there.code_sha256 != here.code_sha256:
            level: Level = "note" if there.package == "mujoco-gear" else "differs"
            yield finding(level, f"{role}: {there.package} {there.version} is installed with other code")
        if there.wheel_sha256 and here.wheel_sha256 and there.wheel_sha256 != here.wheel_sha256:
            yield finding("note", f"{role}: {there.package} was installed from another wheel")


def compare_repeated(record: Record, again: Sequence[Again], *, is_same: bool) -> Iterator[Finding]:
    """Yields the findings about samples that were measured again.

    Args:
        record: the record.
        again: the samples.
        is_same: whether this machine should give equal bytes.
    """
    numbers = [number for number, _ in enumerate(record.data)]
    places = {patch: [n for n in numbers if record.data[n].patch == patch] for patch in record.kinds()}
    claimed = {(one.data, one.index): one for one in record.samples}
    off: dict[str, list[float]] = {}
    sizes: dict[str, float] = {}
    equal = 0
    for one in again:
        number = places[one.patch][one.place]
        there, name = claimed.get((number, one.index)), f"sample {one.index} with {one.patch}, place {one.place + 1}"
        if there is None:
            yield finding("differs", f"{name}: the record has no result of it")
            continue
        has_data = one.content_key == record.data[number].content_key
        if is_same and not has_data:
            yield finding("differs", f"{name}: the config makes other data than the record's content key says")
        equal += there.sha256 == one.sha256
        is_defended = record.entry.defense is not None
        if is_same and has_data and is_defended and there.sha256 != one.sha256:
            yield finding("differs", f"{name}: another prediction than in the record, on the same kind of machine")
        if (there.value is None) != (one.value is None):
            yield finding("differs", f"{name}: {record.sample_metric} is {one.value}, the record says {there.value}")
        elif there.value is not None and one.value is not None:
            off.setdefault(one.patch, []).append(one.value - there.value)
            sizes[one.patch] = sizes.get(one.patch, 0.0) + abs(there.value)
            if abs(one.value - there.value) > MOST_OFF * max(1.0, abs(there.value)):
                text = f"{record.sample_metric} is {one.value:.4f}, the record says {there.value:.4f}"
                yield finding("differs", f"{name}: {text}")
        if there.score is not None and (one.score is None or abs(one.score - there.score) > MOST_OFF):
            yield finding("differs", f"{name}: score {one.score}, the record says {there.score:.4f}")
    for patch, found in off.items():
        mean = float(np.mean(found))
        level: Level = "differs" if abs(mean) > MOST_MEAN_OFF * max(1.0, sizes[patch] / len(found)) else "same"
        yield finding(level, f"{patch}: mean {record.sample_metric} of {len(found)} samples differs by {mean:+.4f}")
    yield finding("note" if equal < len(again) else "same", f"{equal} of {len(again)} predictions have equal bytes")


def compare_fresh(record: Record, fresh: Sequence[Again], seed: int) -> Iterator[Finding]:
    """Yields the findings about samples that are not part of the benchmark.

    The metric of single samples, and the defense's score, should be distributed as in the record. A defense that
    recognises the pictures of the benchmark does worse on other pictures.

    Args:
        record: the record.
        fresh: fresh samples, measured here.
        seed: seed of the statistical test.
    """
    shifts: list[_Shift] = []
    for patch in dict.fromkeys(one.patch for one in fresh):
        here = [one for one in fresh if one.patch == patch]
        places = {one.place for one in here}
        numbers = [number for number, data in enumerate(record.data) if data.patch == patch]
        chosen = {numbers[place] for place in places}
        there = [one for one in record.samples if one.data in chosen]
        sign = -1.0 if record.entry.lower_is_better and record.sample_metric == record.entry.metric else 1.0
        new, old = ([sign * one.value for one in every if one.value is not None] for every in (here, there))
        shifts += _shifted(f"{patch}: {record.sample_metric or 'metric'}", new, old, seed)
        towards = -1.0 if patch in (NONE, RANDOM) else 1.0
        new, old = ([towards * one.score for one in every if one.score is not None] for every in (here, there))
        shifts += _shifted(f"{patch}: score of the defense", new, old, seed)
    for one in shifts:
        if one.p < LEAST_P / len(shifts):
            yield finding("differs", f"{one.text} (p = {one.p:.2g}): it does worse on pictures that it cannot know")
        else:
            yield finding("same", one.text)


@dataclass(frozen=True, slots=True, kw_only=True)
class _Shift:
    """One test of fresh samples against those of the record.

    Attributes:
        text: what was compared, with both means.
        p: one-sided p-value of the fresh samples being worse.
    """

    text: str
    p: float


def _shifted(what: str, new: Sequence[float], old: Sequence[float], seed: int) -> Iterator[_Shift]:
    if len(new) < 2 or len(old) < 2:
        return
    text = f"{what}: {abs(np.mean(new)):.4f} on {len(new)} fresh samples, {abs(np.mean(old)):.4f} in the record"
    yield _Shift(text=text, p=permutation_p(new, old, seed))


def permutation_p(new: Sequence[float], old: Sequence[float], seed: int) -> float:
    """The one-sided p-value of the mean of `new` being smaller than that of `old`, by a permutation test.

    Groups are drawn at random `DRAWS` times; the observed grouping is counted as well (Phipson and Smyth, 2010).

    Args:
        new, old: values of two independent groups; larger is better.
        seed: seed of the draws.
    """
    every = np.array([*new, *old], np.float64)
    observed = np.mean(old) - np.mean(new)
    rng = derive_rng(seed, "leaderboard", "permutation")
    most_rows, as_large = max(1, MOST_NUMBERS // len(every)), 0
    for start in range(0, DRAWS, most_rows):
        shuffled = rng.permuted(np.tile(every, (min(most_rows, DRAWS - start), 1)), axis=1)
        gaps = shuffled[:, len(new) :].mean(axis=1) - shuffled[:, : len(new)].mean(axis=1)
        as_large += int((gaps >= observed - 1e-12).sum())
    return (1 + as_large) / (DRAWS + 1)


def compare_withheld(record: Record, defended: Sequence[Again], alone: Sequence[Again], seed: int) -> Iterator[Finding]:
    """Yields the findings about pictures of withheld scenes: the network behind its defense against the network alone.

    Args:
        record: the record.
        defended, alone: the same samples with and without the defense.
        seed: seed of the drawn sign patterns.
    """
    for patch in dict.fromkeys(one.patch for one in defended):
        pairs = [
            (one.value, other.value)
            for one, other in zip(defended, alone, strict=True)
            if one.patch == patch and one.value is not None and other.value is not None
        ]
        if not pairs:
            continue
        sign = -1.0 if record.entry.lower_is_better and record.sample_metric == record.entry.metric else 1.0
        gains = sign * np.array([one - other for one, other in pairs])
        p = float(paired_p(gains[:, None], seed)[0])
        text = f"withheld scenes, {patch}: the defense gains {gains.mean():+.4f} {record.sample_metric} (p = {p:.2g})"
        claimed = _claimed_gain(record, patch)
        is_contrary = claimed is not None and claimed > 0 and gains.mean() < 0 and p < LEAST_P
        yield finding("differs" if is_contrary else "note", text)


def _claimed_gain(record: Record, patch: str) -> float | None:
    here, there = record.figure(patch), record.figure(patch, is_reference=True)
    if there is None and patch not in (NONE, RANDOM):
        there = record.figure("patch", is_reference=True)
    if here is None or there is None or here.value is None or there.value is None:
        return None
    return (there.value - here.value) if record.entry.lower_is_better else (here.value - there.value)
