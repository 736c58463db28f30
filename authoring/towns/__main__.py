"""`python -m authoring.towns town10`: write a town into mjcf/towns."""

from __future__ import annotations

import argparse
from importlib import import_module
from pathlib import Path

# Where the function is that writes each town.
TOWNS = {
    "town10": "authoring.towns.assemble:write_town10",
    "harbour": "authoring.towns.harbour_build:write_harbour",
    "suburb": "authoring.towns.suburb_build:write_suburb",
}


def main() -> None:
    """Write the town named on the command line."""
    parser = argparse.ArgumentParser(prog="python -m authoring.towns", description="Write a town's MJCF and meshes.")
    parser.add_argument("town", choices=list(TOWNS))
    parser.add_argument("--out", type=Path, default=Path(__file__).parents[2] / "mjcf" / "towns")
    arguments = parser.parse_args()
    module, function = TOWNS[arguments.town].split(":")
    getattr(import_module(module), function)(arguments.out)


if __name__ == "__main__":
    main()
