"""What the pictures share."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from palanquin.sim.scenes.palette import PAYLOAD_PLAN, robot_colour

PAYLOAD = PAYLOAD_PLAN
LIMIT = "tab:red"
OURS, PAPERS = "tab:blue", ("0.4", "tab:purple")
"""Colours of what is done in our way, and of variants of the paper's."""


def new_figure(height: float) -> Figure:
    """A figure as wide as a page, of a height in inches."""
    return Figure(figsize=(10, height), layout="constrained")


def tidy(axes: Axes | Iterable[Axes]) -> None:
    """A light grid, and no frame above and on the right."""
    for each in np.ravel(np.array(axes, dtype=object)):
        each.grid(alpha=0.3)
        each.spines[["top", "right"]].set_visible(False)


def legend_above(axes: Axes, columns: int = 6) -> None:
    """A legend in rows above the axes, where it hides nothing."""
    axes.legend(
        loc="lower left", bbox_to_anchor=(0, 1), ncols=columns, frameon=False, fontsize="small"
    )


def body_colour(body: int) -> tuple[float, float, float, float]:
    """The colour of the payload (0) or of a robot (from 1 on)."""
    return PAYLOAD if body == 0 else robot_colour(body - 1)
