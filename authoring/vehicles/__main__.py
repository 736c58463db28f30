"""Write every vehicle: `python -m authoring.vehicles [--out mjcf/vehicles] [NAME ...]`."""

from __future__ import annotations

import argparse
from pathlib import Path

from authoring.vehicles.catalogue import CATALOGUE, write

_DEFAULT_OUT = Path(__file__).parents[2] / "mjcf" / "vehicles"


def main() -> None:
    """Parse the command line and write the files."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("names", nargs="*", metavar="NAME", help=f"which of {', '.join(CATALOGUE)}; all by default")
    parser.add_argument("--out", type=Path, default=_DEFAULT_OUT)
    arguments = parser.parse_args()
    unknown = sorted(set(arguments.names) - set(CATALOGUE))
    if unknown:
        parser.error(f"no vehicle {', '.join(unknown)}")
    write(arguments.out, arguments.names or list(CATALOGUE))


main()
