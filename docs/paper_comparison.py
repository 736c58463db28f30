"""Writes the tables of `docs/results/paper.md`: gear's results beside those of the CARLA-GeAR paper.

`python docs/paper_comparison.py` reads `docs/results/paper/metrics.csv`, which `gear bench paper` wrote, and Tables 1
and 2 of the paper (`carla-gear-table1.csv`, `carla-gear-table2.csv`), and writes the tables between the markers of the
page. A test fails if they are out of date. All means are over the scenes in which gear was measured, on both sides.
"""

from __future__ import annotations

import csv
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from statistics import mean

RESULTS = Path(__file__).resolve().parent / "results"
PAGE, DATA = RESULTS / "paper.md", RESULTS / "paper"
BEGIN, END = "<!-- tables: written by docs/paper_comparison.py -->", "<!-- end of tables -->"

NETWORKS = {
    "DDRNet": "ddrnet23_slim",
    "BiSeNet": "bisenet_x39",
    "Faster R-CNN": "fasterrcnn_lite0_fpn",
    "RetinaNet": "retinanet_lite0_fpn",
    "AdaBins": "adabins_lite0",
    "GLPDepth": "glpn_b0",
    "Stereo R-CNN": "stereo_centre_lite0",
}
"""gear's network for each network of the paper."""

METRICS = {
    "semseg": ("miou", 100),
    "detect2d": ("ap", 100),
    "stereo3d": ("reference.car_bev_moderate_r40", 100),
    "depth": ("rmse_m", 1),
}
"""The metric of the paper's Table 2 by task, and its factor."""

OUTSIDE = {
    "semseg": "outside_patch.miou",
    "depth": "outside_patch.eigen_d1",
    "detect2d": "found_share",
    "stereo3d": "found_share",
}
"""The metric of single pictures by which patches are compared, by task; higher is better."""

DETECTORS = {"ZM": "zmask", "HN": "hyperneuron", "FPDA": "fpda"}
DEFENSES = {"-": "", "ZM": "zmask", "LGS": "lgs"}

Row = dict[str, str]


def read(name: str) -> list[Row]:
    """The lines of a CSV file of the results.

    Args:
        name: name of the file.
    """
    with (DATA / name).open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


class Measured:
    """gear's numbers, by network, defense, scene, kind of patch and quantity."""

    def __init__(self) -> None:
        """Reads `metrics.csv`."""
        self.rows = read("metrics.csv")
        self.scenes = [name for name in dict.fromkeys(row["scene"] for row in self.rows) if name != "all"]
        self.task = {row["model"]: row["task"] for row in self.rows}

    def numbers(self, column: str = "value", **wanted: str) -> list[float]:
        """The numbers of all rows with these values, in the order of the file.

        Args:
            column: name of the column with the number, such as `value` or `p`.
            **wanted: value of each other column.
        """
        found = [row for row in self.rows if all(row[name] == value for name, value in wanted.items())]
        return [float(row[column]) for row in found if row[column]]


def table(titles: Sequence[str], lines: Iterable[Sequence[str]]) -> list[str]:
    """A table in Markdown, and an empty line.

    Args:
        titles: titles of the columns.
        lines: cells of each line.
    """
    marks = "|".join("---" for _ in titles)
    return [f"| {' | '.join(titles)} |", f"|{marks}|", *(f"| {' | '.join(cells)} |" for cells in lines), ""]


def pairs(label: str, value: Callable[[str, bool], float | None], digits: int) -> list[str]:
    """The cells of one line: its label, and for each network the paper's number and gear's.

    Args:
        label: first cell.
        value: returns the number of a network of the paper, measured by the paper (True) or by gear; None for none.
        digits: digits after the point.
    """
    shown = []
    for network in NETWORKS:
        both = [value(network, by_paper) for by_paper in (True, False)]
        shown.append(" / ".join("–" if one is None else f"{one:.{digits}f}" for one in both))
    return [label, *shown]


def detection(gear: Measured) -> list[str]:
    """The means of Table 1: AUROC of each detector, patched pictures against clean ones."""
    paper = read("carla-gear-table1.csv")

    def line(short: str) -> list[str]:
        def value(network: str, by_paper: bool) -> float | None:
            if by_paper:
                return average(
                    float(row[network]) for row in paper if row["detector"] == short and named(row["scene"], gear)
                )
            wanted = {"model": NETWORKS[network], "defense": DETECTORS[short], "patch": "patch", "quantity": "auroc"}
            return average(one for scene in gear.scenes for one in gear.numbers(scene=scene, against="none", **wanted))

        return pairs(DETECTORS[short], value, 2)

    return table(["detector", *NETWORKS], [line(short) for short in DETECTORS])


def performance(gear: Measured) -> list[str]:
    """The means of Table 2: the clean metric of the undefended network, and all differences to it."""
    paper = read("carla-gear-table2.csv")

    def ours(network: str, defense: str, patch: str, scene: str) -> float | None:
        name, factor = METRICS[gear.task[NETWORKS[network]]]
        wanted = {"model": NETWORKS[network], "defense": defense, "patch": patch, "scene": scene, "metric": name}
        return average(factor * one for one in gear.numbers(quantity="value", **wanted))

    def line(short: str, kind: str) -> list[str]:
        is_reference = short == "-" and kind == "clean"

        def value(network: str, by_paper: bool) -> float | None:
            if by_paper:
                column = f"{network} {kind}"
                return average(
                    float(row[column]) for row in paper if row["defense"] == short and named(row["scene"], gear)
                )
            patch = "none" if kind == "clean" else "patch"
            both = [(ours(network, DEFENSES[short], patch, one), ours(network, "", "none", one)) for one in gear.scenes]
            return average(here - (0.0 if is_reference else clean) for here, clean in both if None not in (here, clean))

        return pairs(f"{DEFENSES[short] or 'no defense'}, {kind}", value, 2)

    kinds = [(short, kind) for short in DEFENSES for kind in ("clean", "patch")]
    return table(["defense, pictures", *NETWORKS], [line(*pair) for pair in kinds])


def strength(gear: Measured) -> list[str]:
    """For each network the metric under each kind of patch, and the paired test outside the patch."""
    lines, tests = [], {}
    for network, name in NETWORKS.items():
        if name not in gear.task:
            continue
        metric, factor = METRICS[gear.task[name]]
        values = [
            average(factor * one for one in gear.numbers(
                model=name, defense="", scene="all", patch=patch, quantity="value", metric=metric))
            for patch in ("none", "random", "patch")
        ]  # fmt: skip
        wanted = {"model": name, "defense": "", "scene": "all", "patch": "patch", "quantity": "mean change"}
        wanted |= {"metric": OUTSIDE[gear.task[name]], "against": "random"}
        change, p = (average(gear.numbers(column, **wanted)) for column in ("value", "p"))
        tests[network] = p
        lines.append([f"{network}: `{name}`", metric, *("–" if one is None else f"{one:.2f}" for one in values),
                      "–" if change is None else f"{change:+.4f}", network])  # fmt: skip
    adjusted = holm(tests)
    shown = [[*cells[:-1], "–" if adjusted[cells[-1]] is None else f"{adjusted[cells[-1]]:.2g}"] for cells in lines]
    return table(["network", "metric", "none", "random", "patch", "change outside the patch", "p (Holm)"], shown)


def holm(tests: dict[str, float | None]) -> dict[str, float | None]:
    """p values after the correction of Holm (1979) for several tests; None stays None.

    Args:
        tests: p by name.
    """
    known = sorted((p, name) for name, p in tests.items() if p is not None)
    adjusted: dict[str, float | None] = dict.fromkeys(tests)
    largest = 0.0
    for rank, (p, name) in enumerate(known):
        largest = max(largest, min(1.0, p * (len(known) - rank)))
        adjusted[name] = largest
    return adjusted


def average(numbers: Iterable[float]) -> float | None:
    """The mean; None of no numbers."""
    known = list(numbers)
    return mean(known) if known else None


def named(scene: str, gear: Measured) -> bool:
    """Whether gear was measured in a scene of the paper.

    Args:
        scene: name in the paper's tables, such as `billboard01`.
        gear: gear's numbers.
    """
    return f"town10-{scene}" in gear.scenes


def page() -> str:
    """The page with its tables."""
    gear = Measured()
    tables = [
        "", "**AUROC of the detectors** (Table 1), means over the scenes, *paper / gear*:", "", *detection(gear),
        "**Performance** (Table 2), means over the scenes, *paper / gear*. The first line is the metric: mIoU of "
        "segmentation, AP of COCO and AP of KITTI's cars in hundredths, and RMSE of depth in metres. All other lines "
        "are differences to it.", "", *performance(gear),
        "**Patches against random patches**, gear, without a defense, over all pictures:", "", *strength(gear),
    ]  # fmt: skip
    before, _, rest = PAGE.read_text(encoding="utf-8").partition(BEGIN)
    return "\n".join([before + BEGIN, *tables, END + rest.partition(END)[2]])


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
