"""Key presses from the terminal, read as they come without stopping the caller."""

from __future__ import annotations

import select
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager

from prompt_toolkit.input import Input, create_input
from prompt_toolkit.keys import Keys

_NAMES = {
    Keys.Up: "up",
    Keys.Down: "down",
    Keys.Left: "left",
    Keys.Right: "right",
    Keys.Tab: "tab",
    Keys.Escape: "q",
    Keys.ControlC: "q",
    Keys.ControlD: "q",
    " ": "space",
}

_ESCAPE_WAIT = 0.05
"""A lone escape byte is a key of its own, and not the beginning of an arrow's code, after this, s.
"""


class Keyboard:
    """Keys by name: up, down, left, right, space, tab, or the character; Escape and Ctrl-C are q.

    Use `open_keyboard`.
    """

    def __init__(self, source: Input) -> None:
        self._source = source
        self._last_byte = 0.0

    def until(self, deadline: float) -> Iterator[str]:
        """Yields keys as they are pressed, until `time.perf_counter()` has reached `deadline`."""
        while True:
            remaining = deadline - time.perf_counter()
            ready, _, _ = select.select([self._source.fileno()], [], [], max(remaining, 0.0))
            if ready:
                self._last_byte = time.perf_counter()
                yield from self._named(self._source.read_keys())
                if self._source.closed:
                    yield "q"
                    return
            elif time.perf_counter() - self._last_byte > _ESCAPE_WAIT:
                yield from self._named(self._source.flush_keys())
            if remaining <= 0:
                return

    def _named(self, presses: list) -> Iterator[str]:  # type: ignore[type-arg]
        for press in presses:
            key = _NAMES.get(press.key, press.key)
            yield str(key.value if isinstance(key, Keys) else key)


@contextmanager
def open_keyboard() -> Iterator[Keyboard]:
    """The terminal's keyboard: keys are neither echoed nor waited for until the context ends.

    Raises ValueError when standard input is no terminal.
    """
    if not sys.stdin.isatty():
        raise ValueError(
            "keys are read from a terminal, and standard input is none; "
            "`--commands FILE` needs no keys"
        )
    source = create_input(sys.stdin)
    with source.raw_mode():
        yield Keyboard(source)
