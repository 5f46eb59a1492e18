"""The result of a run, in numbers and in words."""
