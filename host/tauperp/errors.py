"""The exception for bad input: one line for the user."""


class InputError(ValueError):
    """Bad input from the user. The message is one line: what is wrong, and where.

    The command line prints it after the program's name and exits with 2. Any other exception is a defect of the program
    and keeps its traceback.
    """
