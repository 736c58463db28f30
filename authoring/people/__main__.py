"""Write every person in every pose: `python -m authoring.people [--out DIR] [NAME ...]`."""

from __future__ import annotations

import argparse
from pathlib import Path

from authoring.people.export import write_person, write_textures
from authoring.people.wardrobe import PEOPLE

_DEFAULT_OUT = Path(__file__).parents[2] / "mjcf" / "pedestrians"


def main() -> None:
    """Parse the command line and write the files."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, default=_DEFAULT_OUT)
    parser.add_argument("names", nargs="*", help="people to write, e.g. man_suit; all if none is named")
    arguments = parser.parse_args()
    unknown = set(arguments.names) - {person.name for person in PEOPLE}
    if unknown:
        parser.error(f"no such person: {', '.join(sorted(unknown))}")
    for person in PEOPLE:
        if not arguments.names or person.name in arguments.names:
            write_textures(arguments.out, person)
            for pose in person.poses:
                write_person(arguments.out, person, pose)


if __name__ == "__main__":
    main()
