"""Collects the measured effect of a patch from the files of `gear evaluate`, `gear gap` and `gear attack`."""

from __future__ import annotations

from pathlib import Path

from authoring.weights.patches.plan import EFFECT, OUTSIDE, TASK, PatchPlan
from gear.dataset.json_text import load_json
from gear.values.serial import Json


def read_effect(plan: PatchPlan, root: Path, minutes: float) -> Json:
    """Returns the measured effect of one scene's patch, and facts of the attack.

    Args:
        plan: plan of the patch.
        root: folder to which the commands of the plan wrote.
        minutes: time of all commands.

    Raises:
        DatasetError: a file cannot be read.
    """
    attack = load_json(root / plan.name / "attack.json")
    return {
        "patch": plan.name,
        "task": plan.task,
        "model": plan.model,
        "scene": plan.place,
        "samples": plan.samples,
        "seeds": {split: plan.seed(split) for split in plan.samples},
        "weights_sha256": attack["weights_sha256"],
        "steps": attack["steps_done"],
        **_figures(plan, root),
        "minutes": {"attack": round(attack["seconds"] / 60, 2), "all": round(minutes, 2)},
    }


def read_again(plan: PatchPlan, root: Path) -> Json:
    """Returns the effect of an installed patch on the shipped network, from the files of `PatchPlan.commands_again`.

    Raises:
        DatasetError: a file cannot be read.
    """
    return {
        "weights_sha256": load_json(root / "evaluation/results.json")["model"]["weights_sha256"],
        "samples": plan.samples["test"],
        "seed": plan.seed("test"),
        **_figures(plan, root),
    }


def _figures(plan: PatchPlan, root: Path) -> Json:
    """The measured values; values without any data are None.

    - `metric`: the task's metric without a patch, with a random patch and with this patch.
    - `outside`: mean change of a sample's metric outside the patch, compared with the random patch, and its p.
    - `effect`: change of a metric of the task's evaluator (the task's metric, or that in `EFFECT`) by the composed and
      by the rendered patch, and the second divided by the first (None without an effect or without the metric).
    """
    evaluation, gap = load_json(root / "evaluation/results.json"), load_json(root / "gap/gap.json")
    return {
        "pictures_with_patch": len(gap["samples"]),
        "metric": _metric(plan, evaluation),
        "outside": _outside(plan, evaluation),
        "effect": _effect(gap, EFFECT.get(plan.task, plan.metric[1])),
        "psnr_db": gap["median_psnr_db"].get("transport"),
    }


def _rows(evaluation: Json) -> dict[str, Json]:
    return {_kind(row["dataset"]["patch"]): row for row in evaluation["rows"]}


def _change(evaluation: Json) -> Json:
    """The comparison of this patch with the random patch, from the evaluation."""
    names = tuple(_rows(evaluation)[kind]["name"] for kind in ("patched", "random"))
    return next(one for one in evaluation["differences"] if (one["row"], one["against"]) == names)


def _metric(plan: PatchPlan, evaluation: Json) -> Json:
    """The task's metric for each kind of patch, and its change from the random patch to this patch."""
    report, figure = plan.metric
    return {
        "figure": f"{report}.{figure}".removeprefix(f"{TASK}."),
        **{kind: row["metrics"][report].get(figure, {}).get("value") for kind, row in _rows(evaluation).items()},
        "patched_minus_random": _change(evaluation)["metrics"][report].get(figure),
    }


def _outside(plan: PatchPlan, evaluation: Json) -> Json:
    where, tested = OUTSIDE[plan.task]
    return {"figure": f"{where}.{tested}", **_change(evaluation)["paired"][where][tested]}


def _effect(gap: Json, figure: str) -> Json:
    clean, digital, rendered = (gap["effect"][name].get(figure) for name in ("clean", "transport", "rendered"))
    if clean is None or digital is None or rendered is None:
        return {"figure": figure, "digital": None, "rendered": None, "share": None}
    share = gap["rendered_share_of_digital_effect"].get("transport", {}).get(figure)
    return {"figure": figure, "digital": digital - clean, "rendered": rendered - clean, "share": share}


def _kind(label: str) -> str:
    return label if label in ("none", "random") else "patched"
