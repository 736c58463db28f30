"""Checks finished patches by rendering them in the 3D world, in samples that the attack did not use."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from gear.dataset.json_text import load_json
from gear.dataset.reading import scenes_of
from gear.measuring.gap.report import GapReport
from gear.measuring.gap.request import GapRequest
from gear.measuring.gap.run import measure_gap
from gear.measuring.gap.twin import check_clean
from gear.plugins.datasets import open_dataset, root_and_split
from gear.readers import open_all
from gear.values.errors import DatasetError, GearError
from gear.values.progress import Callbacks
from gear.verbs.attack.data import check_joined
from gear.verbs.attack.folder import VERIFY
from gear.verbs.attack.job import TRAINING, VALIDATION
from gear.verbs.attack.request import VerifyRequest


def check_held_out(data: Sequence[str | Path], held: str | Path, val: Sequence[str | Path] = ()) -> None:
    """Checks that a dataset is suitable for the rendered check of an attack.

    It must exist, have probes (samples rendered with the surfaces black and white), show no patch and have as
    many surfaces as there are patches. The patches must not be optimised or validated on its samples.

    Args:
        data: datasets on which the patches are optimised.
        held: the dataset to check.
        val: datasets on which the patches are validated.

    Raises:
        GearError: one of these conditions does not hold.
    """
    wanted = open_dataset(*root_and_split(held))
    if not wanted.plan.auxiliary:
        raise DatasetError(wanted.root, "has no probes, which --verify needs; collect it with --probes")
    check_clean(wanted)
    for flag, paths, names in (("--data", data, TRAINING), ("--val", val, VALIDATION)):
        try:
            found = open_all(paths, wanted.plan.task["name"], names=names, allow_test_data=True)
        except GearError:
            continue  # the attack itself reports this error
        for one in found:
            check_joined([one, wanted])
            if scenes_of(one) == scenes_of(wanted):
                problem = "no patch may be made on what --verify names; give it another split than"
                raise GearError(f"{held}: {problem} {flag}")


def verify(request: VerifyRequest, callbacks: Callbacks) -> dict[str, GapReport]:
    """Renders finished patches in a held-out dataset, and compares rendered with composed patches: in pixels and
    in their effect.

    A defense draws its random numbers from the seed of the attack, so a calibrated defense is the same one that was
    attacked. The folder `out/verify/<scene>-<split>-<hash>` gets `<model>/gap.json` and `gap.txt` for each model; the
    rendered dataset lies in the folder of the first model.

    Args:
        request: arguments, which `gear.attack` describes.
        callbacks: progress and warnings.

    Returns:
        One report per model, by the model's name.

    Raises:
        GearError: an error that the user can correct; the message is one line.
    """
    root, split = root_and_split(request.data)
    notes = load_json(Path(request.out) / "attack.json")
    made_on = {(one["scene"], one["seed"]) for one in [*notes["data"], *notes["validation"]]}
    dataset = open_dataset(root, split)
    plan = dataset.plan
    if scenes_of(dataset) in made_on:
        raise DatasetError(root, f"is what {request.out} was made on; verify it on other samples")
    scene = Path(plan.info.scene).name
    place = Path(request.out) / VERIFY / f"{scene}-{plan.info.split}-{plan.content_key[:6]}"
    reports: dict[str, GapReport] = {}
    for model in request.models:
        is_first = not reports
        reports[model] = measure_gap(
            GapRequest(
                dataset=root,
                patch=request.out if is_first else None,
                twin=None if is_first else place / request.models[0].replace("/", "-") / "twin",
                split=split,
                model=model,
                model_settings=request.model_settings,
                guard=request.guard,
                samples=request.samples,
                town=request.town if is_first else None,
                scenes=request.scenes if is_first else None,
                out=place / model.replace("/", "-"),
                seed=notes["seed"],
            ),
            callbacks,
        )
    return reports
