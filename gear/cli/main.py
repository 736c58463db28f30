"""The `gear` command: finds the subcommand, runs it, and prints errors that the user can correct as one line."""

from __future__ import annotations

import argparse
import errno
import importlib
import signal
import sys
from collections.abc import Sequence
from types import FrameType

from gear.cli.closed_output import discard_output
from gear.cli.machine_limits import limit_reached
from gear.cli.parser import Parser
from gear.cli.streams import complain, prepare_streams
from gear.reporting.advice import fitted
from gear.reporting.messages import one_line
from gear.values.errors import GearError, UnknownNameError
from gear.values.mujoco_gl import check_mujoco_gl
from gear.values.regular_file import NotAFileError

COMMANDS: dict[str, str] = {
    "collect": "collect a dataset split: pictures with exact ground truth",
    "sheet": "draw samples of a dataset with their ground truth as one picture",
    "view": "write one self-contained HTML page that shows a dataset",
    "train": "train a network on collected data",
    "attack": "optimise adversarial patches for a scene's surfaces against a model",
    "gap": "measure how far composed patches differ from rendered ones",
    "defend": "write the pictures of a dataset as a defense cleans them",
    "evaluate": "measure a model, with or without a defense, on datasets, and compare twins",
    "bench": "run a benchmark of networks, defenses, scenes and patches, and write a report",
    "leaderboard": "check records of benchmark results, and make a leaderboard of them",
    "drive": "drive cars in the closed loop with and without patches, and write a report",
    "verify": "check every file of a dataset, and make damaged samples again",
    "merge": "join the shards of one collection into one dataset",
    "import": "unpack a dataset from an archive and check every file",
    "export": "write a dataset in the layout of another tool",
    "towns": "list towns and their scenes, or draw a map of a town and a picture of every scene",
    "models": "list the installed networks, with their size, input and weights",
    "weights": "convert, average or show weights files",
    "plugins": "list the installed plugins: tasks, models, attacks, defenses, controllers, metrics, loggers",
    "new": "write a small, complete Python package for a new plugin",
    "doctor": "check the renderers of this machine: device, driver and time of a reference frame",
    "show-config": "print the complete collection config that results from flags and files",
    "completion": "print a script with which a shell completes gear's commands and flags",
}
"""One-line description of each command."""

MODULES = {"import": "import_archive"}
"""Modules of commands whose name is a keyword of Python."""

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
"""Error numbers of disks and permissions. An `OSError` with such a number and a file name is printed as one line,
without a traceback.
"""

FULL = {errno.ENOSPC, errno.EDQUOT}

NO_TEMPORARY = "No usable temporary directory"
"""Beginning of Python's error message when no folder for temporary files is usable; this error has no file name."""


def module_of(command: str) -> str:
    """Returns the dotted name of the module that implements a command."""
    return f"gear.cli.commands.{MODULES.get(command, command.replace('-', '_'))}"


class Terminated(KeyboardInterrupt):
    """Raised when the process receives SIGTERM, for example from a batch system; it is handled like Ctrl-C."""


def entry() -> None:
    """Runs the command in `sys.argv` and exits with its exit code; the entry point of the console script `gear`."""
    signal.signal(signal.SIGTERM, _terminate)
    sys.exit(main(sys.argv[1:]))


def main(argv: Sequence[str]) -> int:
    """Runs one command.

    Args:
        argv: words of the command line, without the program's name.

    Returns:
        0 on success; 2 for an error that the user can correct, printed as one line on stderr; 130 after Ctrl-C; 143
        after SIGTERM. `verify` and `view` return 1 if files or samples are faulty. Errors in gear's own code are not
        caught and print their traceback.
    """
    prepare_streams()
    try:
        code = _run(argv)
        sys.stdout.flush()  # an error of the flush at exit could not be caught
    except BrokenPipeError:
        discard_output()
        return 0
    except (KeyboardInterrupt, Exception) as error:
        interrupt = _interrupt_behind(error)
        if interrupt is not None:
            complain("gear: stopped; run the same command again to go on")
            return 143 if isinstance(interrupt, Terminated) else 130
        if (
            isinstance(error, OSError)
            and error.filename
            and (error.errno in CIRCUMSTANCES or isinstance(error, NotAFileError))
        ):
            complain(f"gear: {one_line(error.filename)}: {error.strerror}")
            return 2
        if isinstance(error, OSError) and error.errno in FULL:  # a stream without a name, such as stdout in `> file`
            complain(f"gear: {error.strerror}")
            discard_output()
            return 2
        if isinstance(error, FileNotFoundError) and str(error.strerror).startswith(NO_TEMPORARY):
            complain(f"gear: {error.strerror}; make room there, or set TMPDIR to a folder on another disk")
            return 2
        limit = limit_reached(error)
        if limit is not None:
            complain(f"gear: {limit}")
            return 2
        if not isinstance(error, GearError):
            raise
        complain(f"gear: {fitted(_command_of(argv) or '', one_line(error))}")
        return 2
    return code


def full_parser(wanted: str | None = None) -> Parser:
    """Returns the parser of the whole command line.

    Args:
        wanted: name of the only command whose module is imported and whose flags are added; None adds the flags of all
            commands.
    """
    parser = Parser(
        prog="gear",
        description="Driving datasets with physical adversarial patches in them, rendered by MuJoCo.",
        epilog=EXAMPLES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--version", action="store_true", help="print the version and exit")
    commands = parser.add_subparsers(title="commands", metavar="COMMAND", dest="command")
    for name, summary in COMMANDS.items():
        command = commands.add_parser(
            name, help=summary, description=summary, formatter_class=argparse.RawDescriptionHelpFormatter
        )
        if wanted in (None, name):
            module = importlib.import_module(module_of(name))
            module.add_arguments(command)
            command.set_defaults(run=module.run)
    return parser


def _command_of(argv: Sequence[str]) -> str | None:
    return next((word for word in argv if not word.startswith("-")), None)


def _run(argv: Sequence[str]) -> int:
    wanted = _command_of(argv)
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
    check_mujoco_gl()
    return int(args.run(args))


def _terminate(number: int, frame: FrameType | None) -> None:
    raise Terminated


def _interrupt_behind(error: BaseException | None) -> KeyboardInterrupt | None:
    """Returns the KeyboardInterrupt that caused an error; None if no interrupt caused it.

    A compiled module that is interrupted during its import raises an ImportError instead of the KeyboardInterrupt.
    """
    while error is not None and not isinstance(error, KeyboardInterrupt):
        error = error.__cause__ or error.__context__
    return error


if __name__ == "__main__":
    entry()
