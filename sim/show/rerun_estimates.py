"""What was believed beside what was true, in a Rerun recording."""

from itertools import product

import numpy as np
import rerun as rr

from palanquin.problems.robots import FEET
from palanquin.sim.runs.record import Record
from palanquin.sim.runs.tracking import estimation_error
from palanquin.sim.show.rerun_shapes import quaternion_xyzw

_AXES = 0.3 * np.eye(3)
_COLOURS = [[255, 60, 60], [60, 255, 60], [80, 80, 255]]


def log_estimates(recording: rr.RecordingStream, record: Record, frames: slice) -> None:
    """Frames of the bodies as planner and controllers took them to be, below `estimate`, how wrong
    they were, and forces on feet as torques tell them; nothing where the state is known.
    """
    if "true_bodies" not in record.more:
        return
    times = rr.TimeColumn("sim_time", duration=record.time[frames])
    ticks = rr.TimeColumn("sim_time", duration=record.time)
    error = estimation_error(record)
    for b, name in enumerate(record.team.bodies):
        path, states = f"estimate/{name}", record.bodies[frames, b]
        recording.log(path, rr.Arrows3D(vectors=_AXES, colors=_COLOURS, radii=0.006), static=True)
        columns = rr.Transform3D.columns(
            translation=states[:, :3], quaternion=quaternion_xyzw(states[:, 3:7])
        )
        recording.send_columns(path, [times], columns)
        for kind, values in vars(error).items():
            path = f"control/{name}/estimate/{kind}_error"
            recording.send_columns(path, [ticks], rr.Scalars.columns(scalars=values[:, b]))
    both = {"true": record.more["foot_force"], "known": record.more["known_force"]}
    for (i, robot), (f, foot) in product(enumerate(record.team.names), enumerate(FEET)):
        for kind, forces in both.items():
            path = f"control/{robot}/foot_force/{foot}/{kind}"
            columns = rr.Scalars.columns(scalars=forces[:, i, f, 2])
            recording.send_columns(path, [ticks], columns)
