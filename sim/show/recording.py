"""A Rerun recording of a run (needs the extra `viz`)."""

from pathlib import Path

from palanquin.sim.errors import require_rerun
from palanquin.sim.runs.record import Record
from palanquin.sim.show.joint_motion import AnyMotion


def write_recording(record: Record, shown: AnyMotion, path: Path) -> None:
    """Write `path` (.rrd), which opens on a 3D view beside plots of the run.

    `shown`: the joints' motion of a team with its payload, or of robots on bars in their scene.
    Timeline `sim_time` (s). Entities: `world/<robot>/<link>`, `world/<robot>/<foot>/force`;
    `plan/<robot>`, `plan/<robot>/footholds`; `solver/...` with `solver/phase/<name>` and
    `solver/violation/<family>`; `control/<body>/...` with the tracking errors.

    With a payload in hands also `world/<robot>/hand/force`, `world/payload`, `world/terrain`,
    `plan/payload`, `control/<robot>/kinematics/...` of a kinematic run, and of one in physics
    `control/<robot>/torque/<joint>` as shares of the limits. On bars `world/bar<b>`,
    `world/ground`, `plan/<robot>/<foot>/force` (those below `world` are measured),
    `solver/<robot>/lambda`, and below `control/<robot>` velocities with their references and the
    virtual constraints.

    Raises MissingExtraError when rerun-sdk is not installed.
    """
    require_rerun()
    from palanquin.sim.show import rerun_log

    rerun_log.write(record, shown, path)
