"""Draws the map of gear's rooms and writes the table beside it: `python docs/make_map.py`.

The floors come from `.importlinter`, the arrows from the imports in the code, so that neither can differ from the
code. A test fails when the picture or the table is out of date.
"""

from __future__ import annotations

import configparser
import html
from collections import defaultdict
from pathlib import Path

import grimp

DOCS = Path(__file__).parent
PICTURE = DOCS / "images/rooms.svg"
PAGE = DOCS / "explanation/architecture.md"
BEGIN, END = "<!-- rooms: written by docs/make_map.py -->\n", "<!-- end of rooms -->\n"

Graph = dict[str, set[str]]

ROOMS: dict[str, tuple[float, str, str]] = {
    "cli": (0.62, "command line", "one small file per command: reads arguments, calls the verb, prints"),
    "verbs": (0.62, "what a user does", "`collect`, `train`, `attack`, `evaluate`, `gap`, `bench`, `drive` and more"),
    "view": (0.81, "HTML page", "the page that `gear view` writes"),
    "envs": (0.3, "Gymnasium", "environments in which a policy drives the ego car of the closed loop"),
    "driving": (
        0.3,
        "closed loop",
        "vehicle, scenarios, traffic that reacts, from pictures to motion",
    ),
    "measuring": (
        0.46,
        "models over data",
        "what verbs share when they measure: a guarded model, statistics, twins, the gap",
    ),
    "leaderboard": (
        0.64,
        "records, rules",
        "records of benchmark results, the rules that they must keep, and the rows of a leaderboard",
    ),
    "collecting": (
        0.76,
        "making samples",
        "what verbs share when they collect: jobs, what each worker does, patches, probes",
    ),
    "readers": (0.09, "torch datasets", "datasets of any task as torch reads them: batches, order, prefetching"),
    "testing": (0.92, "for plugin authors", "contract tests and small worlds that plugin authors use"),
    "augment": (0.58, "augmentation", "changes of pictures that keep their ground truth exact"),
    "plugins": (
        0.31,
        "built-in plugins",
        "discovery, datasets with their tasks, and the built-in plugins, one file each",
    ),
    "compositor": (0.67, "patch into picture", "puts patches into pictures, exactly and differentiably"),
    "networks": (0.2, "graphs, losses", "network graphs, losses, weights, by task"),
    "groundtruth": (0.25, "labels, boxes", "measures labels, boxes and visibility in a frame"),
    "metrics": (0.08, "scores", "the benchmarks' own metrics"),
    "formats": (0.42, "file formats", "reads and writes Cityscapes, COCO, KITTI, PNG"),
    "world": (0.92, "towns, traffic", "towns, roads, traffic, weather and surfaces as MuJoCo models"),
    "render": (0.75, "renderers", "`raster`, `filament` and `classic` behind one protocol"),
    "dataset": (
        0.42,
        "files on disk",
        "whole files, plans, sidecars, manifests, locks, worker processes",
    ),
    "camera": (0.09, "light to bytes", "air, rain, night, lens, noise and response of the camera"),
    "config": (0.64, "YAML", "YAML files to typed configs; errors with file, line and column"),
    "contracts": (0.14, "protocols", "protocols and specs that rooms and plugins agree on"),
    "values": (0.14, "plain data", "scene records, frames, geometry, labels, errors; NumPy only"),
    "reporting": (
        0.8,
        "progress, legends",
        "progress bars and plain lines, drawing of legends",
    ),
}
"""Every room: its place from left (0) to right (1), two words for the picture, a line for the table."""

GROUPS = (
    ("what users run", 2),
    ("what verbs share", 3),
    ("plugins and their parts", 2),
    ("worlds, labels, files", 1),
    ("basics", 4),
)
"""Groups of floors, from the top: a name for the picture, and the number of floors."""

GROUP_PX = 170
"""Width of the column with the names of the groups, left of the rooms."""

WIDTH_PX, FLOOR_PX, BOX_PX, BOX_HEIGHT_PX, MARGIN_PX = 1020, 74, 150, 44, 20


def floors() -> list[list[str]]:
    """The rooms floor by floor, from the highest to the lowest, as the contract of the layers lists them."""
    contracts = configparser.ConfigParser()
    contracts.read(DOCS.parent / ".importlinter")
    lines = contracts["importlinter:contract:layers"]["layers"].split("\n")
    return [[room.strip().removeprefix("gear.") for room in line.split("|")] for line in lines if line.strip()]


def imports() -> Graph:
    """For each room the other rooms that its modules import, imports for type checking left out."""
    graph = grimp.build_graph("gear", exclude_type_checking_imports=True)
    found: Graph = defaultdict(set)
    for module in graph.modules:
        for imported in graph.find_modules_directly_imported_by(module):
            rooms = [name.split(".")[1] if "." in name else "" for name in (module, imported)]
            if all(rooms) and rooms[0] != rooms[1]:
                found[rooms[0]].add(rooms[1])
    return dict(found)


def without_shortcuts(graph: Graph) -> Graph:
    """The same graph without arrows that a longer way already implies."""
    reached: Graph = {}

    def below(room: str) -> set[str]:
        if room not in reached:
            reached[room] = set[str]().union(*({one} | below(one) for one in graph.get(room, ())))
        return reached[room]

    return {
        room: {one for one in targets if not any(one in below(other) for other in targets)}
        for room, targets in graph.items()
    }


def picture() -> str:
    """The map as SVG."""
    rows = floors()
    centres = {
        room: (GROUP_PX + ROOMS[room][0] * WIDTH_PX, MARGIN_PX + at * FLOOR_PX + BOX_HEIGHT_PX / 2)
        for at, row in enumerate(rows)
        for room in row
    }
    height = 2 * MARGIN_PX + (len(rows) - 1) * FLOOR_PX + BOX_HEIGHT_PX
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {GROUP_PX + WIDTH_PX} {height}" '
        'font-family="sans-serif">',
        '<defs><marker id="tip" viewBox="0 0 8 8" refX="7" refY="4" markerWidth="7" markerHeight="7" orient="auto">'
        '<path d="M0 0 8 4 0 8z" fill="#456"/></marker></defs>',
        f'<rect width="{GROUP_PX + WIDTH_PX}" height="{height}" fill="#fff"/>',
    ]
    assert sum(count for _, count in GROUPS) == len(rows)
    first = 0
    for number, (name, count) in enumerate(GROUPS):
        top, tall = MARGIN_PX + first * FLOOR_PX - (FLOOR_PX - BOX_HEIGHT_PX) / 2, count * FLOOR_PX
        fill = "#f2f5f8" if number % 2 == 0 else "#fff"
        parts += [
            f'<rect y="{top:.0f}" width="{GROUP_PX + WIDTH_PX}" height="{tall}" fill="{fill}"/>',
            f'<text x="12" y="{top + tall / 2:.0f}" font-size="14" font-style="italic" fill="#345">{name}</text>',
        ]
        first += count
    for room, targets in sorted(without_shortcuts(imports()).items()):
        parts += [_arrow(centres[room], centres[target]) for target in sorted(targets)]
    for room, (x, y) in centres.items():
        parts += [
            f'<rect x="{x - BOX_PX / 2:.0f}" y="{y - BOX_HEIGHT_PX / 2:.0f}" width="{BOX_PX}" height="{BOX_HEIGHT_PX}" '
            'rx="6" fill="#fff" stroke="#234"/>',
            f'<text x="{x:.0f}" y="{y - 3:.0f}" text-anchor="middle" font-size="15" fill="#123">{room}</text>',
            f'<text x="{x:.0f}" y="{y + 14:.0f}" text-anchor="middle" font-size="11" fill="#567">'
            f"{html.escape(ROOMS[room][1])}</text>",
        ]
    return "\n".join([*parts, "</svg>", ""])


def _arrow(start: tuple[float, float], end: tuple[float, float]) -> str:
    x0, y0, x1, y1 = start[0], start[1] + BOX_HEIGHT_PX / 2, end[0], end[1] - BOX_HEIGHT_PX / 2 - 1
    shift = max(min((x0 - x1) * 0.25, BOX_PX * 0.4), -BOX_PX * 0.4)  # arrows from one side arrive on that side
    x0, x1 = x0 - shift, x1 + shift
    bend = max(24.0, (y1 - y0) * 0.4)
    return (
        f'<path d="M{x0:.0f} {y0:.0f}C{x0:.0f} {y0 + bend:.0f} {x1:.0f} {y1 - bend:.0f} {x1:.0f} {y1:.0f}" '
        'fill="none" stroke="#456" stroke-width="1.3" marker-end="url(#tip)"/>'
    )


def table() -> str:
    """The rooms in the order of their floors, with what each imports."""
    graph = imports()
    order = [room for row in floors() for room in row]
    lines = ["| floor | room | what it holds | imports |", "|---|---|---|---|"]
    for at, row in enumerate(floors()):
        for room in row:
            targets = ", ".join(f"`{one}`" for one in order if one in graph.get(room, ()))
            lines.append(f"| {len(floors()) - at} | `{room}` | {ROOMS[room][2]} | {targets or 'nothing of gear'} |")
    return "\n".join(lines) + "\n"


def page() -> str:
    """The page on the architecture with the table of rooms as the code is."""
    text = PAGE.read_text(encoding="utf-8")
    before, rest = text.split(BEGIN)
    _, after = rest.split(END)
    return f"{before}{BEGIN}\n{table()}\n{END}{after}"


def main() -> None:
    """Writes both."""
    PICTURE.write_text(picture(), encoding="utf-8")
    PAGE.write_text(page(), encoding="utf-8")


if __name__ == "__main__":
    main()
