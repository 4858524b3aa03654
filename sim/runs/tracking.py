"""How far bodies are from their references."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from palanquin.problems.quaternions import normalised
from palanquin.sim.runs.record import Record

Array = NDArray[np.float64]


@dataclass(frozen=True)
class TrackingError:
    """Errors of all bodies (payload first) at every tick.

    `position` [T, R+1] distances (m); `orientation` [T, R+1] angles (rad); `velocity` [T, R+1]
    (m/s).
    """

    position: Array
    orientation: Array
    velocity: Array


def tracking_error(record: Record) -> TrackingError:
    """Measured states of `record` against its references."""
    x, reference = record.bodies, record.references
    cosine = np.abs(np.sum(normalised(x[..., 3:7]) * normalised(reference[..., 3:7]), axis=-1))
    return TrackingError(
        position=np.linalg.norm(x[..., :3] - reference[..., :3], axis=-1),
        orientation=2 * np.arccos(np.clip(cosine, 0.0, 1.0)),
        velocity=np.linalg.norm(x[..., 7:10] - reference[..., 7:10], axis=-1),
    )
