"""A table of the measured effects of patches."""

from __future__ import annotations

from collections.abc import Sequence

from gear.values.serial import Json

SURE = 0.01
"""Limit of p for a clear effect."""

HEAD = ("scene", "none", "random", "patched", "outside patch", "p", "digital", "rendered", "share", "PSNR dB", "min")


def table(effects: Sequence[Json]) -> str:
    """Returns one line per scene, and a last line with the number of clear effects."""
    if not effects:
        return "no patch is complete\n"
    first = effects[0]
    lines = [HEAD, *(_line(one) for one in effects)]
    widths = [max(len(line[i]) for line in lines) for i in range(len(HEAD))]
    text = ["  ".join([line[0].ljust(widths[0]), *map(str.rjust, line[1:], widths[1:])]) for line in lines]
    sure = sum(is_clearly_worse(one) for one in effects)
    title = f"{first['task']}: {first['model']}, {first['metric']['figure']}"
    last = (
        f"clearly worse than a random patch outside the patch ({first['outside']['figure']}, p < {SURE}): "
        f"{sure} of {len(effects)} scenes"
    )
    return "\n".join([title, *text, last]) + "\n"


def is_clearly_worse(effect: Json) -> bool:
    """Whether samples have a clearly lower metric outside the patch than with a random patch."""
    outside = effect["outside"]
    return outside["p"] is not None and outside["p"] < SURE and outside["mean"] < 0


def _line(one: Json) -> tuple[str, ...]:
    metric, outside, effect = one["metric"], one["outside"], one["effect"]
    return (
        one["scene"],
        *(_number(metric[kind]) for kind in ("none", "random", "patched")),
        _number(outside["mean"], "+.3f"),
        _number(outside["p"], ".2g"),
        _number(effect["digital"], "+.3f"),
        _number(effect["rendered"], "+.3f"),
        _number(effect["share"], ".2f"),
        _number(one["psnr_db"], ".1f"),
        _number(one["minutes"]["all"], ".1f"),
    )


def _number(value: float | None, form: str = ".3f") -> str:
    return "-" if value is None else format(value, form)
