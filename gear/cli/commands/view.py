"""`gear view`: writes one self-contained HTML page for browsing a dataset."""

from __future__ import annotations

import argparse

from gear.cli.flag_types import positive

EXAMPLE = """examples:
  gear view data/stereo3d/town10-billboard01-ClearNoon/none
  gear view data/twin --split test --samples 200 --out twin.html
  gear view data/none --twin data/random --twin data/patched --evaluation evaluations/semseg/ddrnet23_slim
  gear view evaluations/semseg/ddrnet23_slim+zmask        # its datasets, predictions and defended pictures
  gear view drive/quick                    # plays the drives of gear drive, twins beside each other
  gear view data/big --max-mb 400          # larger pictures; the page takes longer to open

The page is one file; it needs no server and no network. On the page, press ? for a list of keys.
"""


def megabytes(text: str) -> float:
    """Parses `text`, a size in megabytes, 1 to 4000; a `type` function for argparse."""
    number = float(text)
    if not 1 <= number <= 4000:
        raise argparse.ArgumentTypeError("must be 1 to 4000")
    return number


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Adds the flags of `gear view` to its argument parser."""
    parser.epilog = EXAMPLE
    parser.add_argument("dataset", help="root of a dataset of any task, a folder of twins, an evaluation, or drives")
    parser.add_argument(
        "--twin",
        action="append",
        default=[],
        dest="twins",
        metavar="DIR",
        help="dataset that differs only in its patch, shown beside the first; DIR:SPLIT; repeatable",
    )
    parser.add_argument(
        "--evaluation",
        action="append",
        default=[],
        dest="evaluations",
        metavar="DIR",
        help="folder of `gear evaluate` whose predictions are shown; repeatable",
    )
    parser.add_argument("--split", help="split to show, if the dataset has several")
    parser.add_argument("--samples", type=positive, metavar="N", help="only the first N samples or drives (all)")
    parser.add_argument("--out", default="view.html", metavar="FILE", help="HTML file to write (view.html)")
    parser.add_argument(
        "--max-mb",
        type=megabytes,
        default=48.0,
        metavar="MB",
        help="approximate size limit of the page; pictures are scaled down until they fit (48)",
    )


def run(args: argparse.Namespace) -> int:
    """Writes the page and prints its path.

    Args:
        args: arguments of the command line, as the parser of this command returns them.

    Returns:
        0, or 1 if the pictures or labels of some samples could not be shown.
    """
    from gear.reporting.display import Display
    from gear.view.write import write_view

    with Display("view") as display:
        report = write_view(
            args.dataset,
            args.out,
            twins=args.twins,
            evaluations=args.evaluations,
            split=args.split,
            samples=args.samples,
            max_mb=args.max_mb,
            on_progress=display.callbacks.on_progress,
        )
    print(report.summary())
    return 1 if report.problems else 0
