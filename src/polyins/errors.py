"""The one exception for input that is wrong, told apart from a program that is wrong."""


class InputError(ValueError):
    """The command line, the configuration or the data are wrong.

    The message is for the user: what is wrong, where (file, line or key), and what was expected.
    """
