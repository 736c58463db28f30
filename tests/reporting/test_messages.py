"""One line means one line, in any encoding."""

from __future__ import annotations

import subprocess
import sys

import pytest

from gear.reporting.messages import LONGEST, one_line
from gear.values.errors import GearError


def test_line_breaks_and_control_characters_become_visible() -> None:
    assert one_line(GearError("a\nb\x1b[31mc\u2028d")) == "a b\\x1b[31mc\\u2028d"


@pytest.mark.parametrize("quote", ["'", '"'])
def test_long_quoted_values_are_cut(quote: str) -> None:
    text = one_line(f"expected int, got {quote}{'x' * 5000}{quote}; mend it")
    assert len(text) < LONGEST + 60 and text.endswith(f"…{quote}; mend it")
    short = f"got {quote}{'x' * LONGEST}{quote}"
    assert one_line(short) == short


def test_values_without_quotes_are_cut_and_names_of_files_are_not() -> None:
    text = one_line(f"--set weather.cloudiness={'x' * 5000}: expected float")
    assert len(text) < LONGEST + 60 and text.endswith("x… expected float")
    name = "n" * 255
    assert one_line(f"/data/{name}/{name}: no such file") == f"/data/{name}/{name}: no such file"
    assert len(one_line(f"/data/{'n' * 3000}: is not a dataset")) < LONGEST + 60


@pytest.mark.parametrize("encoding", ["ascii", "latin-1"])
@pytest.mark.parametrize("command", ["attack", "train", "collect"])
def test_help_in_any_encoding(command: str, encoding: str) -> None:
    code = f"from gear.cli.main import main; main([{command!r}, '--help'])"
    done = subprocess.run(
        [sys.executable, "-c", code],
        env={**_environment(), "PYTHONIOENCODING": encoding},
        capture_output=True,
        check=False,
    )
    assert done.returncode == 0 and b"examples:" in done.stdout and not done.stderr


@pytest.mark.parametrize("encoding", ["ascii", "latin-1"])
def test_a_name_that_the_terminal_cannot_write_is_escaped(encoding: str) -> None:
    code = "from gear.cli.main import main; raise SystemExit(main(['sheet', 'd\\u00e4t\\u00e4\\u2026']))"
    done = subprocess.run(
        [sys.executable, "-c", code],
        env={**_environment(), "PYTHONIOENCODING": encoding},
        capture_output=True,
        check=False,
    )
    assert done.returncode == 2 and done.stderr.count(b"\n") == 1 and b"\\u2026" in done.stderr


def _environment() -> dict[str, str]:
    import os

    return dict(os.environ)
