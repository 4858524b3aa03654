"""Text files that users hand in."""

from __future__ import annotations

from pathlib import Path

MOST_BYTES = 64_000_000
"""Of a file; more is taken for a mistake, such as a device that never ends."""


def read_text(path: str | Path) -> str:
    """The contents of a file in UTF-8, with or without a byte order mark.

    Raises OSError for a file that cannot be read, and ValueError that says why for one that is too
    large or no text in UTF-8.
    """
    with Path(path).open("rb") as file:
        data = file.read(MOST_BYTES + 1)
    if len(data) > MOST_BYTES:
        raise ValueError(f"it has more than {MOST_BYTES // 1_000_000} MB")
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise ValueError(f"not a text file in UTF-8: {error.reason}") from error
