"""The verb `gap`: compares composed patches (pasted into pictures) with the same patches rendered in the scene."""
