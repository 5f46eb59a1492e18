"""What came of a run, in numbers and in words."""
