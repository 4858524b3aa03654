"""How far bodies are from their references."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from palanquin.problems.quaternions import normalised
from palanquin.sim.runs.record import Record

Array = NDArray[np.float64]


@dataclass(frozen=True)
class TrackingError:
    """Distances of all bodies (payload first) from where they should be at every tick.

    `position` [T, R+1] distances (m); `orientation` [T, R+1] angles (rad); `velocity` [T, R+1]
    (m/s).
    """

    position: Array
    orientation: Array
    velocity: Array


def tracking_error(record: Record) -> TrackingError:
    """States of `record`, as they truly were, against its references."""
    return difference(record.true_bodies, record.references)


def estimation_error(record: Record) -> TrackingError:
    """What planner and controllers took for the states, against what they truly were."""
    return difference(record.bodies, record.true_bodies)


def difference(x: Array, reference: Array) -> TrackingError:
    """Of states [T, B, 13]."""
    cosine = np.abs(np.sum(normalised(x[..., 3:7]) * normalised(reference[..., 3:7]), axis=-1))
    return TrackingError(
        position=np.linalg.norm(x[..., :3] - reference[..., :3], axis=-1),
        orientation=2 * np.arccos(np.clip(cosine, 0.0, 1.0)),
        velocity=np.linalg.norm(x[..., 7:10] - reference[..., 7:10], axis=-1),
    )
