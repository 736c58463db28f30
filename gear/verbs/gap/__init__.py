"""The verb `gap`: patches put in digitally, held against the same patches rendered."""
