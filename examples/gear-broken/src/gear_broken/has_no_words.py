"""Raises an exception whose text cannot be had."""


class MuteError(BaseException):
    """Is no `Exception`, and raises when it is printed."""

    def __str__(self) -> str:
        raise GeneratorExit


raise MuteError
