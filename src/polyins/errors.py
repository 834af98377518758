"""The exceptions for input that is wrong, told apart from a program that is wrong."""


class InputError(ValueError):
    """The command line, the configuration or the data are wrong.

    The message is for the user: what is wrong, where (file, line or key), and what was expected.
    """


class ImplausibleError(InputError):
    """Data that cannot be right as far as can be judged; `checks: {accept: [kind]}` has them taken as they are."""

    def __init__(self, kind: str, message: str) -> None:
        """`kind`: of the finding that it is."""
        super().__init__(message)
        self.kind = kind
