"""Stairs, stepping stones and walkways along x, made of foothold areas."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from palanquin.errors import ProblemError
from palanquin.problems import checks
from palanquin.problems.foothold_areas import FootholdArea, FootholdAreas


def stairs(
    steps: int, rise: float, tread: float, start: float, width: float, landing: float = 4.0
) -> FootholdAreas:
    """Level ground, then steps up or down along x, then level ground again.

    Args:
        steps: number of risers, at least 1.
        rise: height of each, m; negative goes down.
        tread: depth of a step along x, m.
        start: x of the first riser, m.
        width: along y, about y = 0, m.
        landing: length of the level ground before and after, m.
    """
    if steps < 1:
        raise ProblemError(f"stairs: steps is {steps}; it must be at least 1")
    rise, start = checks.finite("stairs: rise", rise), checks.finite("stairs: start", start)
    tread = checks.positive("stairs: tread", tread)
    landing = checks.positive("stairs: landing", landing)
    edges = start + np.concatenate(
        [[-landing], tread * np.arange(steps), [tread * (steps - 1) + landing]]
    )
    return FootholdAreas(
        tuple(
            FootholdArea.rectangle(((near + far) / 2, 0.0), (far - near, width), rise * level)
            for level, (near, far) in enumerate(pairwise(edges))
        )
    )


def stepping_stones(
    seed: int,
    length: float,
    start: float,
    width: float,
    pitch: float = 0.24,
    size: float = 0.18,
    scatter: float = 0.02,
    unevenness: float = 0.03,
    landing: float = 4.0,
) -> FootholdAreas:
    """A field of square stones between two pieces of level ground along x.

    Stones stand on a grid of `pitch`; the seed draws for each a place and a height, uniform within
    `scatter` and `unevenness` either way, and a heading within 0.2 rad.

    Args:
        seed: of the random draws.
        length: of the field along x, m.
        start: x at which it begins, m.
        width: of field and level ground along y, about y = 0, m.
        pitch: of the grid along x and y, m.
        size: side of a stone, m, less than `pitch`.
        scatter: of the stones' places, m.
        unevenness: of the stones' heights, m.
        landing: length of the level ground before and after, m.
    """
    if seed < 0:
        raise ProblemError(f"stones: seed is {seed}; it must be at least 0")
    length, width = (
        checks.positive("stones: length", length),
        checks.positive("stones: width", width),
    )
    pitch, size = checks.positive("stones: pitch", pitch), checks.positive("stones: size", size)
    if size >= pitch:
        raise ProblemError(f"stones: size {size} m must be less than the pitch {pitch} m")
    for name, value in (("scatter", scatter), ("unevenness", unevenness)):
        checks.non_negative(f"stones: {name}", value)
    random = np.random.default_rng(seed)
    columns, rows = max(1, round(length / pitch)), max(1, round(width / pitch))
    stones = []
    for column in range(columns):
        for row in range(rows):
            x = start + (column + 0.5) * pitch + random.uniform(-scatter, scatter)
            y = (row - (rows - 1) / 2) * pitch + random.uniform(-scatter, scatter)
            z, yaw = random.uniform(-unevenness, unevenness), random.uniform(-0.2, 0.2)
            stones.append(FootholdArea.rectangle((x, y), (size, size), z, yaw))
    end = start + columns * pitch
    return FootholdAreas(
        (
            FootholdArea.rectangle((start - landing / 2, 0.0), (landing, width)),
            *stones,
            FootholdArea.rectangle((end + landing / 2, 0.0), (landing, width)),
        )
    )


def walkway(
    lanes: tuple[float, ...],
    lane_width: float,
    start: float,
    length: float,
    width: float,
    height: float = 0.0,
    landing: float = 4.0,
) -> FootholdAreas:
    """Planks along x between two pieces of level ground, which they overlap a little or meet.

    Args:
        lanes: y of each plank's middle, m.
        lane_width: their width, m.
        start: x at which they begin, m.
        length: of the planks, m.
        width: of the level ground along y, about y = 0, m.
        height: of the planks over the level ground, m.
        landing: length of the level ground before and after, m.
    """
    if not lanes:
        raise ProblemError("walkway: lanes is empty; feet must stand somewhere")
    length = checks.positive("walkway: length", length)
    middle = checks.finite("walkway: start", start) + length / 2
    planks = (
        FootholdArea.rectangle(
            (middle, checks.finite("walkway: lane", y)), (length, lane_width), height
        )
        for y in lanes
    )
    offset = (length + landing) / 2
    grounds = (
        FootholdArea.rectangle((middle + side * offset, 0.0), (landing, width)) for side in (-1, 1)
    )
    return FootholdAreas((*grounds, *planks))
