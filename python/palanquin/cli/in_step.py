"""Runs in step with the wall's clock, perhaps driven by keys."""

from __future__ import annotations

import time as clock
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from palanquin.cli.keyboard import Keyboard
    from palanquin.sim.scenarios.script import Director, Orders


class InStep:
    """Asks a director for a tick's orders when it is due; keys are taken until then.

    The clock starts when the first tick, whose plan may take its time, is over. What is late is not
    caught up with: the team would rush.

    Args:
        director: gives the orders.
        keyboard: whose keys are taken; none unless told.
        press: is told each key.

    Attributes:
        late: how many ticks were.
    """

    def __init__(
        self,
        director: Director,
        keyboard: Keyboard | None = None,
        press: Callable[[str], None] = lambda key: None,
    ) -> None:
        self._director, self._keyboard, self._press = director, keyboard, press
        self.late, self._due, self._has_begun = 0, 0.0, False

    def at(self, time: float, pose: Any, period: float) -> Orders | None:
        """As of `Director`."""
        now = clock.perf_counter()
        if self._has_begun:
            self._due = (self._due or now) + period
            self.late += now > self._due
            self._due = max(self._due, now)
            self._wait()
        self._has_begun = True
        return self._director.at(time, pose, period)

    def _wait(self) -> None:
        if self._keyboard is None:
            clock.sleep(max(self._due - clock.perf_counter(), 0.0))
            return
        for key in self._keyboard.until(self._due):
            self._press(key)
