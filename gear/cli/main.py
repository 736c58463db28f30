"""`gear`: finds the command, runs it, and is the only place that catches."""

from __future__ import annotations

import argparse
import errno
import importlib
import signal
import sys
from collections.abc import Sequence
from types import FrameType

from gear.cli.messages import one_line
from gear.cli.parser import Parser
from gear.cli.streams import prepare_streams
from gear.cli.unread import print_no_more
from gear.values.errors import GearError, UnknownNameError

COMMANDS: dict[str, str] = {
    "collect": "collect a dataset split: pictures with exact ground truth",
    "sheet": "a contact sheet of a dataset, as one picture",
    "view": "one self-contained HTML page of a dataset",
    "train": "train a network on collected data",
    "attack": "make adversarial patches for a scene's surfaces and a model",
    "gap": "hold digital patches against the same patches rendered",
    "defend": "write a dataset's pictures as a defense cleans them",
    "evaluate": "run a model, with or without a defense, over datasets: metrics, predictions, twins compared",
    "bench": "networks and defenses over scenes and patches, the whole way, with a report",
    "export": "write a dataset in another layout",
    "towns": "list towns and their scenes, or draw a map and a picture of every scene",
    "models": "list the installed networks: size, input, published weights, shipped weights and what is missing",
    "weights": "make safetensors of a published weights file, or show what a file says of itself",
    "plugins": "list the installed tasks, models, attacks and defenses",
    "new": "write a complete small package for a task, model, attack or defense of your own",
    "doctor": "render a reference frame with each renderer and say who renders",
    "show-config": "print the config that flags and files make",
    "completion": "print a script with which a shell completes gear's commands and flags",
}
"""Command names with one line each; `gear.cli.<name>` holds the command."""

EXAMPLES = """examples:
  gear collect --task stereo3d                      a KITTI stereo dataset around billboard01
  gear collect --task semseg --scene billboard04 --patch random
  gear collect --task depth --split train --weather CloudySunset --out data/depth
  gear plugins --kind task
  gear doctor
"""


CIRCUMSTANCES = {
    errno.EACCES, errno.EPERM, errno.ENAMETOOLONG, errno.ELOOP, errno.ENOSPC, errno.EDQUOT, errno.EROFS, errno.EIO,
    errno.ESTALE,
}  # fmt: skip
"""What disks and permissions refuse is nobody's bug, wherever it comes up."""

FULL = {errno.ENOSPC, errno.EDQUOT}

NO_TEMPORARY = "No usable temporary directory"
"""How Python says, without a file's name, that every disk on which it looks for one is full or takes no files."""


class Terminated(KeyboardInterrupt):
    """Somebody, a batch system perhaps, asks the process to end: it does as after Ctrl-C."""


def entry() -> None:
    """Console entry point."""
    signal.signal(signal.SIGTERM, _terminate)
    sys.exit(main(sys.argv[1:]))


def main(argv: Sequence[str]) -> int:
    """Runs one command.

    Returns:
        0, 2 for what the user can put right (one line on stderr), 130 when interrupted, 143 when terminated. Bugs keep
        their traceback.
    """
    prepare_streams()
    try:
        code = _run(argv)
        sys.stdout.flush()  # what fails at Python's own end, nobody catches
    except BrokenPipeError:
        print_no_more()
        return 0
    except (KeyboardInterrupt, Exception) as error:
        interrupt = _interrupt_behind(error)
        if interrupt is not None:
            print("gear: stopped; run the same command again to go on", file=sys.stderr)
            return 143 if isinstance(interrupt, Terminated) else 130
        if isinstance(error, OSError) and error.filename and error.errno in CIRCUMSTANCES:
            print(f"gear: {one_line(error.filename)}: {error.strerror}", file=sys.stderr)
            return 2
        if isinstance(error, OSError) and error.errno in FULL:  # a stream that says no name, as that of `> file`
            print(f"gear: {error.strerror}", file=sys.stderr)
            print_no_more()
            return 2
        if isinstance(error, FileNotFoundError) and str(error.strerror).startswith(NO_TEMPORARY):
            print(
                f"gear: {error.strerror}; make room there, or set TMPDIR to a folder on another disk", file=sys.stderr
            )
            return 2
        if not isinstance(error, GearError):
            raise
        print(f"gear: {one_line(error)}", file=sys.stderr)
        return 2
    return code


def full_parser(wanted: str | None = None) -> Parser:
    """The parser of the command line.

    Args:
        wanted: the only command that gets its flags, so that only its module is imported; None for all of them.
    """
    parser = Parser(
        prog="gear",
        description="Driving datasets with physical adversarial patches in them, rendered by MuJoCo.",
        epilog=EXAMPLES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--version", action="store_true", help="print the version and leave")
    commands = parser.add_subparsers(title="commands", metavar="COMMAND", dest="command")
    for name, summary in COMMANDS.items():
        command = commands.add_parser(
            name, help=summary, description=summary, formatter_class=argparse.RawDescriptionHelpFormatter
        )
        if wanted in (None, name):
            module = importlib.import_module(f"gear.cli.{name.replace('-', '_')}")
            module.add_arguments(command)
            command.set_defaults(run=module.run)
    return parser


def _run(argv: Sequence[str]) -> int:
    wanted = next((word for word in argv if not word.startswith("-")), None)
    if wanted is not None and wanted not in COMMANDS:
        print(f"gear: {one_line(UnknownNameError('command', wanted, COMMANDS))}", file=sys.stderr)
        return 2
    parser = full_parser(wanted or "")
    args, unknown = parser.parse_known_args(argv)
    if unknown:
        (parser.command(args.command) if args.command else parser).refuse(unknown)
    if args.version:
        from importlib.metadata import version

        print(f"gear {version('mujoco-gear')}")
        return 0
    if args.command is None:
        parser.print_help()
        return 0
    return int(args.run(args))


def _terminate(number: int, frame: FrameType | None) -> None:
    raise Terminated


def _interrupt_behind(error: BaseException | None) -> KeyboardInterrupt | None:
    """The Ctrl-C that made an error: compiled modules that it stops in their import raise an ImportError from it."""
    while error is not None and not isinstance(error, KeyboardInterrupt):
        error = error.__cause__ or error.__context__
    return error


if __name__ == "__main__":
    entry()
