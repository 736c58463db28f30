"""`gear import`: unpacks a dataset from an archive and checks every file."""

from __future__ import annotations

import argparse

EXAMPLE = """examples:
  gear import none.tar.gz --out data/none

Make an archive with: tar -C data -czf none.tar.gz none
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Adds the flags of `gear import` to its argument parser."""
    parser.epilog = EXAMPLE
    parser.add_argument("archive", metavar="FILE", help="tar (.gz, .bz2, .xz) or zip archive of a dataset's folder")
    parser.add_argument("--out", required=True, metavar="DIR", help="folder of the dataset; must be empty or new")


def run(args: argparse.Namespace) -> int:
    """Unpacks the archive, prints the path of the dataset and returns exit code 0.

    Args:
        args: arguments of the command line: `archive` and `out`.
    """
    from gear.verbs.import_archive.run import import_archive

    report = import_archive(args.archive, out=args.out, progress=True)
    print(report.summary())
    return 0
