"""The rendered check of an attack: its patches in the world, on samples that it did not see."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from pathlib import Path

from gear.verbs.gap.report import GapReport
from gear.verbs.gap.run import gap
from gear.verbs.train.data import root_and_split

FOLDER = "verify"


def verify(
    out: str | Path,
    data: str | Path,
    *,
    models: Sequence[str],
    settings: Iterable[str] = (),
    samples: int | None = None,
    town: str | Path | None = None,
    scenes: str | Path | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> dict[str, GapReport]:
    """Renders a patch folder on a held-out dataset, and compares pictures and effect, digital and rendered.

    Under `out/verify` lie the rendered twin, and for each model `<model>/gap.json` and `gap.txt`.

    Args:
        out: the patch folder.
        data: root of a dataset of the scene with probes, or `DIR:SPLIT`; not one that the patches were made on.
        models: names of model plugins.
        settings: `KEY=VALUE` texts for their options.
        samples: its first so many samples; all unless given.
        town, scenes: files of its town and of that one's scene library, where they are none of gear's own.
        progress: told after every sample.

    Returns:
        Reports by model.

    Raises:
        GearError: anything that the user can put right; its text is one line.
    """
    root, split = root_and_split(data)
    place, texts, reports = Path(out) / FOLDER, list(settings), {}
    for number, model in enumerate(models):
        reports[model] = gap(
            root,
            patch=out if number == 0 else None,
            twin=None if number == 0 else place / models[0].replace("/", "-") / "twin",
            split=split,
            model=model,
            settings=texts,
            samples=samples,
            town=town,
            scenes=scenes,
            out=place / model.replace("/", "-"),
            progress=progress,
        )
    return reports
