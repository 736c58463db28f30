"""Write every surface: `python -m authoring.surfaces [--out mjcf/surfaces]`."""

from __future__ import annotations

import argparse
from pathlib import Path

from authoring.surfaces.billboard import write_billboard

_DEFAULT_OUT = Path(__file__).parents[2] / "mjcf" / "surfaces"


def main() -> None:
    """Parse the command line and write the files."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, default=_DEFAULT_OUT)
    write_billboard(parser.parse_args().out)


main()
