"""Data that the engine has a copy of."""

from __future__ import annotations


class Mirrored:
    """Base of immutable data whose cached property `core` is the engine's copy.

    Pickled and deep copies go without it and make one of their own when it is asked for.
    """

    def __getstate__(self) -> dict[str, object]:
        """All but the engine's copy."""
        return {name: value for name, value in vars(self).items() if name != "core"}
