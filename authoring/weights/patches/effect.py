"""What a patch does, gathered from the files of the evaluation, the gap and the attack."""

from __future__ import annotations

from pathlib import Path

from authoring.weights.patches.plan import EFFECT, OUTSIDE, TASK, PatchPlan
from gear.dataset.json_text import load_json
from gear.values.serial import Json


def read_effect(plan: PatchPlan, root: Path, minutes: float) -> Json:
    """The figures of one scene's patch, and how it was made.

    Args:
        plan: of the scene.
        root: where its commands wrote.
        minutes: spent on it.

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
    """The figures of the same patch with the network of today, by `PatchPlan.commands_again`.

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
    """What was measured.

    `metric` holds the task's own figure without a patch, with a random one and with this one; `outside` the mean change
    of a sample's figure outside the patch against the random one, with its p; `effect` what the patch changes of a
    figure of the task's own evaluator (the same one, or that of `EFFECT`), digitally and rendered, and the share of the
    first that the second is (None where there is no effect or no such figure). Figures that have nothing to be measured
    on are None.
    """
    evaluation, gap = load_json(root / "evaluation/results.json"), load_json(root / "gap/gap.json")
    return {
        "pictures_with_patch": len(gap["samples"]),
        "metric": _metric(plan, evaluation),
        "outside": _outside(plan, evaluation),
        "effect": _effect(gap, EFFECT.get(plan.task, plan.figure[1])),
        "psnr_db": gap["median_psnr_db"].get("transport"),
    }


def _rows(evaluation: Json) -> dict[str, Json]:
    return {_kind(row["dataset"]["patch"]): row for row in evaluation["rows"]}


def _change(evaluation: Json) -> Json:
    """From the random patch to this one."""
    names = tuple(_rows(evaluation)[kind]["name"] for kind in ("patched", "random"))
    return next(one for one in evaluation["differences"] if (one["row"], one["against"]) == names)


def _metric(plan: PatchPlan, evaluation: Json) -> Json:
    """The task's own figure in each row, and its change from the random patch to this one."""
    report, figure = plan.figure
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
