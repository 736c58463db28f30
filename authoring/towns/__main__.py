"""`python -m authoring.towns town10`: write a town into mjcf/towns."""

from __future__ import annotations

import argparse
from pathlib import Path

from authoring.towns.assemble import write_town10


def main() -> None:
    """Write the town named on the command line."""
    parser = argparse.ArgumentParser(prog="python -m authoring.towns", description="Write a town's MJCF and meshes.")
    parser.add_argument("town", choices=["town10"])
    parser.add_argument("--out", type=Path, default=Path(__file__).parents[2] / "mjcf" / "towns")
    write_town10(parser.parse_args().out)


if __name__ == "__main__":
    main()
