"""The verb `gap`: compares composed patches with the same patches rendered."""
