"""The rendered check of an attack: its patches in the world, on samples that it did not see."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path

from gear.dataset.reading import scenes_of
from gear.dataset.sidecar import load_json
from gear.plugins.datasets import open_dataset, root_and_split
from gear.readers import open_all
from gear.values.errors import DatasetError, GearError
from gear.values.progress import Progress
from gear.verbs.attack.data import check_joined
from gear.verbs.attack.folder import VERIFY
from gear.verbs.attack.job import TRAINING, VALIDATION
from gear.verbs.gap.report import GapReport
from gear.verbs.gap.run import gap
from gear.verbs.gap.twin import check_clean


def check_held_out(data: Sequence[str | Path], held: str | Path, val: Sequence[str | Path] = ()) -> None:
    """Whether a dataset is there, has probes and no patch, fits the patches, and shows none of the scenes that they are
    made on, or chosen by.

    Raises:
        GearError: it is not.
    """
    wanted = open_dataset(*root_and_split(held))
    if not wanted.plan.auxiliary:
        raise DatasetError(wanted.root, "has no probes, which --verify needs; collect it with --probes")
    check_clean(wanted)
    for flag, paths, names in (("--data", data, TRAINING), ("--val", val, VALIDATION)):
        try:
            found = open_all(paths, wanted.plan.task["name"], names=names, allow_test_data=True)
        except GearError:
            continue  # the attack knows what is wrong
        for one in found:
            check_joined([one, wanted])
            if scenes_of(one) == scenes_of(wanted):
                problem = "no patch may be made on what --verify names; give it another split than"
                raise GearError(f"{held}: {problem} {flag}")


def verify(
    out: str | Path,
    data: str | Path,
    *,
    models: Sequence[str],
    model_settings: Iterable[str] = (),
    defense: str | None = None,
    defense_settings: Iterable[str] = (),
    calibration: str | Path | None = None,
    calibration_patched: str | Path | None = None,
    samples: int | None = None,
    town: str | Path | None = None,
    scenes: str | Path | None = None,
    on_progress: Progress | None = None,
    on_fit_progress: Progress | None = None,
) -> dict[str, GapReport]:
    """Renders a patch folder on a held-out dataset, and compares pictures and effect, digital and rendered.

    A defense draws what it draws from the attack's seed: one that learns is the one that was looked through.

    Under `out/verify/<scene>-<split>-<hash>`, one for each dataset, lie for each model `<model>/gap.json` and
    `gap.txt`, and beside those of the first the rendered twin.

    Args:
        out: the patch folder.
        data: root of a dataset of the scene with probes, or `DIR:SPLIT`; not one that the patches were made on, or
            by which the best of them were chosen.
        models: names of model plugins.
        model_settings: `KEY=VALUE` texts for their options.
        defense: a defense plugin that they stand behind.
        defense_settings: for its options.
        calibration: dataset from which the defense learns.
        calibration_patched: the same with patches.
        samples: its first so many samples; all unless given.
        town, scenes: files of its town and of that one's scene library, where they are none of gear's own.
        progress: told after every sample.
        learning: told after every calibration sample that the defense reads for the first time.

    Returns:
        Reports by model.

    Raises:
        GearError: anything that the user can put right; its text is one line.
    """
    root, split = root_and_split(data)
    notes = load_json(Path(out) / "attack.json")
    made_on = {(one["scene"], one["seed"]) for one in [*notes["data"], *notes["validation"]]}
    dataset = open_dataset(root, split)
    plan = dataset.plan
    if scenes_of(dataset) in made_on:
        raise DatasetError(root, f"is what {out} was made on; verify it on other samples")
    place = Path(out) / VERIFY / f"{Path(plan.info.scene).name}-{plan.info.split}-{plan.content_key[:6]}"
    texts, defense_texts, reports = list(model_settings), list(defense_settings), {}
    for number, model in enumerate(models):
        reports[model] = gap(
            root,
            patch=out if number == 0 else None,
            twin=None if number == 0 else place / models[0].replace("/", "-") / "twin",
            split=split,
            model=model,
            model_settings=texts,
            defense=defense,
            defense_settings=defense_texts,
            calibration=calibration,
            calibration_patched=calibration_patched,
            samples=samples,
            town=town if number == 0 else None,
            scenes=scenes if number == 0 else None,
            out=place / model.replace("/", "-"),
            seed=notes["seed"],
            on_progress=on_progress,
            on_fit_progress=on_fit_progress,
        )
    return reports
