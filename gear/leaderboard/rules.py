"""The rules of the leaderboard: what a row needs to be ranked, and signs that its defense was attacked too weakly.

`docs/reference/leaderboard-rules.md` states the rules for people. The signs follow Athalye et al., "Obfuscated
Gradients Give a False Sense of Security" (ICML 2018), section 3.1, and Carlini et al., "On Evaluating Adversarial
Robustness" (2019).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from gear.leaderboard.record import Figure, Record

NONE, RANDOM, PATCH, ADAPTIVE = "none", "random", "patch", "adaptive patch"

TRANSFER = f"{PATCH} of "
"""Beginning of the kinds of patches that were optimised against another network, followed by its name."""

MOST_CLEAN_LOSS = 0.02
"""Largest loss on clean pictures: two points of a metric in 0..1, or 2 % of an error."""

SEEDS = 3
"""Number of seeds with which a random defense must be measured."""

LEAST_RETAINED = 0.5
"""Share of its gain under static patches, or of its AUROC above chance, that a defense must keep under adaptive
patches.
"""

LEAST_KEPT = 0.5
"""Share of the predicted rise of an objective along its gradient below which gradients count as masked."""


def is_transfer(kind: str) -> bool:
    """Whether a kind of patch was optimised against another network; a record does not hold such patches."""
    return kind.startswith(TRANSFER)


def robust_figures(record: Record) -> list[Figure]:
    """The ranked metric of a record under every optimised patch: `patch`, `adaptive patch`, and patches of other
    networks. Numbers that the record does not have are left out.

    Args:
        record: the record.
    """
    kinds = [kind for kind in record.kinds() if kind not in (NONE, RANDOM)]
    return [figure for kind in kinds if (figure := record.figure(kind)) is not None]


def worst(figures: Sequence[Figure], *, lower_is_better: bool) -> Figure | None:
    """The number that is worst for the network; None if no number has a value.

    Args:
        figures: numbers of one metric, such as those of `robust_figures`.
        lower_is_better: whether small values of the metric are good for the network.
    """
    known = [one for one in figures if one.value is not None]
    sign = -1.0 if lower_is_better else 1.0
    return min(known, key=lambda one: sign * (one.value or 0.0), default=None)


def harm(record: Record, one: Figure, other: Figure) -> float:
    """How much worse `one` is than `other` for the network, in units of the record's ranked metric; negative if it is
    better.

    Args:
        record: the record, which says whether lower values are better.
        one: a number with a value.
        other: a number with a value.
    """
    assert one.value is not None and other.value is not None
    return (one.value - other.value) if record.entry.lower_is_better else (other.value - one.value)


def is_clearly_worse(record: Record, one: Figure, other: Figure) -> bool:
    """Whether `one` is worse for the network than `other`, and the value of `other` lies outside the interval of `one`.
    Without an interval, `one` only has to be worse.

    Args:
        record: the record, which says whether lower values are better.
        one: a number with a value.
        other: a number with a value.
    """
    return _is_clearly(record, one, other, is_worse=True)


def _is_clearly(record: Record, one: Figure, other: Figure, *, is_worse: bool) -> bool:
    """`is_clearly_worse`, or the same with `better` in place of `worse`."""
    assert other.value is not None
    is_higher = is_worse == record.entry.lower_is_better
    near = one.low if is_higher else one.high
    if near is None:
        return (harm(record, one, other) if is_worse else harm(record, other, one)) > 0
    return near > other.value if is_higher else near < other.value


def clean_loss(record: Record) -> float | None:
    """How much a defense costs on clean pictures, compared with the network alone.

    Args:
        record: the record of the network with its defense.

    Returns:
        The loss of the metric, or for errors (lower is better) the increase as a share of the error of the network
        alone; negative if the defense helps. None if one of the two values is missing.
    """
    here, there = record.figure(NONE), record.figure(NONE, is_reference=True)
    if here is None or there is None or there.value is None:
        return None
    loss = harm(record, here, there)
    return loss / there.value if record.entry.lower_is_better and there.value else loss


def survives_only_static(record: Record) -> bool:
    """Whether a defense helps under patches that were made without knowledge of it, and adaptive patches leave less
    than half of this gain. Both gains are against the network alone under patches made against it.

    The static gain must be clear: the value of the network alone lies outside the interval of the defended network.
    The adaptive patches must be clearly worse than the static ones in the same sense.

    Args:
        record: the record of the network with its defense.
    """
    alone = record.figure(PATCH, is_reference=True)
    static, adaptive = record.figure(PATCH), record.figure(ADAPTIVE)
    if alone is None or static is None or adaptive is None:
        return False
    if alone.value is None or static.value is None or adaptive.value is None:
        return False
    gained, kept = harm(record, alone, static), harm(record, alone, adaptive)
    is_clear = gained > 0 and _is_clearly(record, static, alone, is_worse=False)
    return is_clear and is_clearly_worse(record, adaptive, static) and kept < LEAST_RETAINED * gained


def faults(records: Sequence[Record]) -> list[str]:
    """The reasons why a row must not be ranked, one line each.

    Args:
        records: the row's own records, one per seed; at least one.
    """
    first = records[0]
    lines = [
        f"the figure without {what} is missing" if kind == NONE else f"the figure with {what} is missing"
        for kind, what in ((NONE, "a patch"), (RANDOM, "random patches"), (PATCH, "optimised patches"))
        if any(one.figure(kind) is None for one in records)
    ]
    if first.entry.defense is None:
        return lines
    if all(one.figure(ADAPTIVE) is None for one in records):
        hint = "; it has no gradient: use an attack that counts queries" if first.entry.gradient == "none" else ""
        lines.append(f"the defense was not attacked adaptively (figure with {ADAPTIVE}es){hint}")
    elif first.entry.gradient == "none" and all(one.attack.knowledge != "black-box" for one in records):
        lines.append("the defense has no gradient, so its adaptive attack must be one that counts queries")
    seeds = {one.benchmark.seed for one in records}
    if first.entry.is_random and len(seeds) < SEEDS:
        lines.append(f"the defense is random: {SEEDS} seeds are needed, there are {len(seeds)}")
    losses = [loss for one in records if (loss := clean_loss(one)) is not None]
    if not losses:
        lines.append("the figures of the network without the defense are missing")
    elif max(losses) > MOST_CLEAN_LOSS:
        lines.append(f"it loses {100 * max(losses):.1f} points on clean pictures; at most 2 are allowed")
    return lines


def warnings(own: Sequence[Record], others: Sequence[Record] = ()) -> list[str]:
    """Signs that the attacks on a row were too weak, for example because gradients are masked; one line each.

    Args:
        own: records of the row.
        others: attacks of other people on the same row.
    """
    every = [*own, *others]
    lines = [line for record in every for line in _within(record)]
    lines += _between(every)
    return list(dict.fromkeys(lines))


def _within(record: Record) -> Iterator[str]:
    patch, random, adaptive = record.figure(PATCH), record.figure(RANDOM), record.figure(ADAPTIVE)
    for name, figure in (("patches", patch), ("adaptive patches", adaptive)):
        if figure is not None and random is not None and not is_clearly_worse(record, figure, random):
            yield f"optimised {name} are not clearly worse than random ones"
    if patch is not None and adaptive is not None and harm(record, adaptive, patch) <= 0:
        yield "adaptive patches are no worse than patches made without knowledge of the defense"
    if survives_only_static(record):
        yield "the defense survives only static attacks: adaptive patches leave less than half of its gain"
    own = [one for one in record.patches if "+" in one.target or record.entry.defense is None]
    kept = [one.gradient_kept for one in own if one.gradient_kept is not None]
    if kept and min(kept) < LEAST_KEPT:
        yield f"the objective follows its gradient only in part ({min(kept):.2f}), so gradients may be masked"
    weak = [one.scene for one in own if one.gain is not None and one.gain <= 0]
    if weak:
        yield f"the attack did not raise its objective over random patches in {', '.join(sorted(set(weak))[:3])}"


def _between(records: Sequence[Record]) -> Iterator[str]:
    """Compares records of one row that were attacked in different ways."""
    for one in records:
        for other in records:
            here = worst(robust_figures(one), lower_is_better=one.entry.lower_is_better)
            there = worst(robust_figures(other), lower_is_better=other.entry.lower_is_better)
            if one is other or here is None or there is None:
                continue
            black = one.attack.knowledge == "black-box" and other.attack.knowledge == "white-box"
            if black and is_clearly_worse(one, here, there):
                yield "a black-box attack is stronger than a white-box attack, so gradients may be masked"
            is_same = one.attack.plugin.identity == other.attack.plugin.identity
            effort, less = (max(each.attack.steps, each.attack.queries) for each in (one, other))
            if is_same and one.benchmark.seed == other.benchmark.seed and effort > less and harm(one, here, there) <= 0:
                yield f"{effort} steps of {one.attack.plugin.name} harm no more than {less}"
