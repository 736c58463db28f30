"""Write every two-wheeler: `python -m authoring.two_wheelers [--out DIR] [NAME ...]`."""

from __future__ import annotations

import argparse
from pathlib import Path

from authoring.two_wheelers.catalogue import two_wheelers
from authoring.two_wheelers.export import write_two_wheeler

_DEFAULT_OUT = Path(__file__).parents[2] / "mjcf" / "vehicles"


def main() -> None:
    """Parse the command line and write the files."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, default=_DEFAULT_OUT)
    parser.add_argument("names", nargs="*", help="what to write, e.g. bicycle_a; all if none is named")
    arguments = parser.parse_args()
    machines = {machine.name: machine for machine in two_wheelers()}
    unknown = set(arguments.names) - set(machines)
    if unknown:
        parser.error(f"no such two-wheeler: {', '.join(sorted(unknown))}")
    for name in arguments.names or machines:
        write_two_wheeler(arguments.out, machines[name])


if __name__ == "__main__":
    main()
