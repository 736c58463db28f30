"""The report of a benchmark as one self-contained HTML page: tables, charts, predictions, and pictures of the patches
in the scenes.
"""

from __future__ import annotations

import base64
import itertools
from collections.abc import Iterable, Sequence
from pathlib import Path
from urllib.parse import quote

import numpy as np

from gear.config.dump import to_yaml
from gear.contracts.tasks import NO_PATCH
from gear.dataset.files import read_bytes
from gear.formats.png import decode_rgb
from gear.plugins.datasets import open_dataset
from gear.reporting.html_table import Cell, Link, html_table, safe
from gear.reporting.report_page import report_page
from gear.verbs.bench.chart import chart
from gear.verbs.bench.drives.results import LEGEND, DriveSection
from gear.verbs.bench.paper.page import paper_table
from gear.verbs.bench.paper.tables import paper_tables, scenes_of
from gear.verbs.bench.pictures.figure import figure
from gear.verbs.bench.pictures.predictions import predictions
from gear.verbs.bench.plan import Plan, Weather
from gear.verbs.bench.report import BenchReport, TaskResult
from gear.verbs.bench.scenes import Scene
from gear.verbs.bench.table import columns, defense_title, legend, title
from gear.verbs.bench.validation import TaskPlugins
from gear.verbs.evaluate.page import PAGE
from gear.verbs.evaluate.table import few_streets_note

PICTURE_PX, PATCH_PX = 560, 220
"""Width of pictures and width of patches in pixels."""


def page(report: BenchReport, plan: Plan) -> str:
    """Returns the page of a benchmark as HTML text. Names from configs are escaped, and the page has no scripts.

    Args:
        report: results of the benchmark.
        plan: plan of the benchmark, which has the config and the folders of pictures.
    """
    facts = report.facts
    counts = plan.config.samples
    where = f"{len(facts['scenes'])} scene{'s' * (len(facts['scenes']) > 1)}, {', '.join(facts['weathers'])}"
    versions = ", ".join(f"{name} {text}" for name, text in facts["versions"].items())
    parts = [
        f'<p class="dim">{safe(facts["command"])}; seed {facts["seed"]}; {safe(versions)}</p>',
        f"<p>{safe(where)}; {counts.measure} pictures of each scene and weather for every kind of patch. Patches: "
        f"{safe(plan.config.attack.plugin)} on {counts.attack} other pictures of a scene in each weather.</p>",
        f'<p class="dim">{safe(legend())}.</p>',
        *(
            f'<p class="dim">Note: {safe(note)}</p>'
            for note in [
                *few_streets_note(cell for task in report.tasks for cells in columns(task) for cell in cells),
                *facts["notes"],
            ]
        ),
    ]
    for task, task_plugins in zip(report.tasks, plan.plugins_of_tasks, strict=True):
        parts += [f"<h2>{safe(title(task))}</h2>", _table(task)]
        if task.metric is not None:
            drawn = base64.b64encode(chart(task, "svg")).decode()
            name = safe(f"bars of {task.metric.title} by network, defense and patch")
            parts.append(f'<p><img alt="{name}" src="data:image/svg+xml;base64,{drawn}"></p>')
        parts += [_scenes(task, report.out), *predictions(task, scenes_of(report)), *_pictures(plan, task_plugins)]
    if report.drives is not None:
        parts += _drives(report.drives)
    parts += [paper_table(table) for table in paper_tables(report)]
    parts.append(f"<h2>Config</h2><pre>{safe(to_yaml(plan.config))}</pre>")
    return report_page(report.title, parts)


def _drives(section: DriveSection) -> Iterable[str]:
    """Yields the section about drives: the table, links to the reports of each scene, and drives without a place."""
    titles, *rows = section.rows() or [[]]
    yield f'<h2>Drives in the closed loop</h2><p class="dim">{safe(LEGEND)}.</p>'
    if rows:
        yield html_table(
            titles, [(number == 0 or row[:3] != rows[number - 1][:3], row) for number, row in enumerate(rows)]
        )
    links = [f'<li><a href="{safe(quote(study))}/report.html">{safe(study)}</a></li>' for study in section.studies]
    yield f"<h3>Reports of the drives</h3><ul>{''.join(links)}</ul>"
    failed = [f"<li>{safe(title)}: {safe(problem)}</li>" for title, problem in section.failed]
    yield f"<h3>Drives that could not be made</h3><ul>{''.join(failed)}</ul>" if failed else ""


def _table(task: TaskResult) -> str:
    rows, before = [], ("", "")
    titles, *every = columns(task)
    for cells in every:
        network = (cells[0], cells[1])
        shown = cells if network != before else ["", "", *cells[2:]]
        rows.append((network != before, shown))
        before = network
    return html_table(titles, rows)


def _scenes(task: TaskResult, out: Path) -> str:
    """Returns an HTML table of the metric in each scene, with one column per kind of patch; the names of networks are
    links to pictures of what changed most.
    """
    kinds = list(dict.fromkeys(at.patch for one in task.results for at in one.scenes))
    rows: list[tuple[bool, Sequence[Cell]]] = []
    for one in task.results:
        places = dict.fromkeys((at.scene, at.weather) for at in one.scenes)
        for number, (scene, weather) in enumerate(places):
            here = {at.patch: at.value.value for at in one.scenes if (at.scene, at.weather) == (scene, weather)}
            values = [f"{here[kind]:.3f}" if here.get(kind, np.nan) == here.get(kind, np.nan) else "" for kind in kinds]
            link = Link(one.model, quote((one.evaluation.out / PAGE).relative_to(out).as_posix()))
            name: list[Cell] = [link, defense_title(task, one)] if number == 0 else ["", ""]
            rows.append((number == 0, [*name, scene, weather, *values]))
    return (
        f"<h3>Scene by scene</h3>{html_table(['network', 'defense', 'scene', 'weather', *kinds], rows)}" if rows else ""
    )


def _pictures(plan: Plan, task_plugins: TaskPlugins) -> Iterable[str]:
    """Yields for each scene its pictures without a patch and with each network's patch, as HTML.

    Each scene is represented by the sample in which most pixels of the patch surfaces are visible.
    """
    for scene, weather in plan.places():
        clean = open_dataset(plan.pictures(task_plugins, scene, weather, NO_PATCH))
        seen = [sum(one.visible_px for one in clean.sidecar(i).surfaces) for i in range(len(clean))]
        number = int(np.argmax(seen))
        figures = [_shown(plan, task_plugins, scene, weather, NO_PATCH, number, "without a patch")]
        for model, defense in itertools.product(task_plugins.models, plan.adaptive_defenses(task_plugins)):
            name = plan.name(model, defense)
            figures.append(_shown(plan, task_plugins, scene, weather, name, number, f"with the patch against {name}"))
            figures += [
                figure(decode_rgb(read_bytes(path)), f"{path.stem} against {name}", PATCH_PX)
                for path in sorted(plan.patch(task_plugins, scene, name).glob("patch_*.png"))
            ]
        yield f'<h3>{safe(f"{scene.label}, {weather.label}")}</h3><div class="row">{"".join(figures)}</div>'


def _shown(
    plan: Plan, task_plugins: TaskPlugins, scene: Scene, weather: Weather, patch: str, number: int, caption: str
) -> str:
    images = open_dataset(plan.pictures(task_plugins, scene, weather, patch))[number].images
    return figure(next(iter(images.values())), caption, PICTURE_PX)
