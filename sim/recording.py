"""A Rerun recording of a tracked rollout (needs the extra `viz`)."""

from pathlib import Path

from palanquin.sim.errors import require_rerun
from palanquin.sim.kinematic import KinematicTrajectory
from palanquin.sim.runs.record import Record


def write_recording(rollout: Record, trajectory: KinematicTrajectory, path: Path) -> None:
    """Write `path` (.rrd), which opens on a 3D view beside plots of the solver's figures.

    Timeline `sim_time` (s). Entities: `world/<robot>/<link>`, `world/<robot>/<foot>/force`,
    `world/<robot>/hand/force`, `world/payload`, `world/terrain`; `plan/payload`, `plan/<robot>`
    and `plan/<robot>/footholds`; `solver/...` with `solver/phase/<name>` and
    `solver/violation/<family>`; `control/...` with the tracking errors.

    Raises MissingExtraError when rerun-sdk is not installed.
    """
    require_rerun()
    from palanquin.sim import rerun_log

    rerun_log.write(rollout, trajectory, path)
