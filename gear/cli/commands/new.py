"""`gear new`: writes a small, complete Python package for a new plugin."""

from __future__ import annotations

import argparse

from gear.contracts.specs import KINDS

EXAMPLE = """examples:
  gear new defense my_blur
  gear new task lanes --out ~/code
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Adds the flags of `gear new` to its argument parser."""
    parser.epilog = EXAMPLE
    parser.add_argument("kind", choices=KINDS, help="kind of plugin")
    parser.add_argument("name", help="the plugin's name: lower case letters, digits and underscores")
    parser.add_argument("--out", default=".", metavar="DIR", help="folder to make the package's folder in (.)")


def run(args: argparse.Namespace) -> int:
    """Writes the package, prints the next steps and returns exit code 0.

    Args:
        args: arguments of the command line: `kind`, `name` and `out`.
    """
    import shlex

    from gear.verbs.scaffold.write import new_package

    folder = new_package(args.kind, args.name, out=args.out)
    print(f"{folder}: a package that works as it is; next:")
    print(f"  cd {shlex.quote(str(folder))}\n  python -m pip install -e '.[dev]'\n  python -m pytest")
    return 0
