"""Errors that a user of Palanquin can provoke; messages name the field, the value and the rule."""


class PalanquinError(Exception):
    """Base class of all errors raised by Palanquin's Python layer."""


class ProblemError(PalanquinError, ValueError):
    """A problem is stated inconsistently: sizes, names, or symbols that do not belong to it."""


class LoweringError(PalanquinError, RuntimeError):
    """A problem could not be turned into code: no compiler, a failed compile, a bad cache."""
