"""Settings: `KEY=VALUE` texts that set one option each."""

from __future__ import annotations


class Setting(str):
    """A `KEY=VALUE` text with the words in which the user gave it, so that errors can repeat these.

    Attributes:
        given: the words, such as `--model-set seed=1`.
    """

    given: str

    def __new__(cls, text: str, given: str = "") -> Setting:
        """Makes the setting.

        Args:
            text: the setting as `KEY=VALUE`.
            given: as the attribute; "" for `--set KEY=VALUE`.
        """
        setting = super().__new__(cls, text)
        setting.given = given or f"--set {text}"
        return setting
