from __future__ import annotations

import pytest

from gear.plugins.text import LONGEST, one_line, printable


class MuteError(Exception):
    def __str__(self) -> str:
        raise GeneratorExit


class OddError(Exception):
    def __str__(self) -> str:
        return 3  # type: ignore[return-value]


class NamelessType(type):
    @property
    def __name__(cls) -> str:  # type: ignore[override]
        raise KeyboardInterrupt


class NamelessError(Exception, metaclass=NamelessType):
    pass


class OddText(str):
    def strip(self, chars: str | None = None) -> str:
        raise KeyboardInterrupt


class OddTextError(Exception):
    def __str__(self) -> str:
        return OddText("text\nmore")


@pytest.mark.parametrize(
    ("error", "line"),
    [
        (ValueError("one\ntwo"), "ValueError: one"),
        (ValueError(""), "ValueError"),
        (ValueError("\x1b[31mred\x07"), r"ValueError: \x1b[31mred\x07"),
        (MuteError(), "MuteError (whose text cannot be had: GeneratorExit)"),
        (OddError(), "OddError (whose text cannot be had: TypeError)"),
        (KeyError("boom"), "KeyError: 'boom'"),
        (NamelessError("boom"), "NamelessError: boom"),
        (OddTextError(), "OddTextError: text"),
    ],
)
def test_an_exception_is_one_printable_line(error: Exception, line: str) -> None:
    assert one_line(error) == line


def test_long_texts_are_cut() -> None:
    assert printable("a" * (LONGEST + 5)) == "a" * LONGEST + "…"
    assert len(printable("\x1b" * 10**6)) <= LONGEST + 1
    assert printable("ärger ✓") == "ärger ✓"
