"""The one error that a person can cause: bad input, said in one line."""


class InputError(ValueError):
    """What a user handed over cannot be used. The message is one line: what is wrong, and where.

    The command line prints it after the program's name and exits with 2. Everything else that is raised is a defect of
    the program and keeps its traceback.
    """
