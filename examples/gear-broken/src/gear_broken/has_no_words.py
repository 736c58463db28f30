"""Raises an exception whose own text raises."""


class MuteError(BaseException):
    """Is no `Exception`, and raises when it is printed."""

    def __str__(self) -> str:
        raise GeneratorExit


raise MuteError
