"""Errors of scenes, rollouts and pictures; messages name the field, the value and the rule."""

from importlib import import_module

from palanquin.errors import PalanquinError


class InputError(PalanquinError, ValueError):
    """A team, a rollout or an option that cannot be used."""


class GraphicsError(PalanquinError, RuntimeError):
    """This machine can't draw; the message says which packages help."""


class MissingExtraError(PalanquinError, ImportError):
    """An optional package is not installed; the message says how to get it."""


def require_rerun() -> None:
    """Raises MissingExtraError when rerun-sdk is not installed."""
    try:
        import_module("rerun")
    except ModuleNotFoundError as error:
        raise MissingExtraError(
            "rerun-sdk is not installed; `pip install palanquin[viz]` adds it"
        ) from error
