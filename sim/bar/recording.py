"""A Rerun recording of a run of bar carriers (needs the extra `viz`)."""

from __future__ import annotations

from pathlib import Path

from palanquin.sim.bar.scene import BarScene
from palanquin.sim.errors import require_rerun
from palanquin.sim.runs.record import Record


def write_recording(record: Record, scene: BarScene, path: Path) -> None:
    """Write `path` (.rrd). Timeline `sim_time` (s).

    Entities: `world/<robot>/<link>`, `world/<robot>/<foot>/force` (of the simulation),
    `world/bar<b>`, `world/ground`; `plan/<robot>` and `plan/<robot>/<foot>/force`;
    `solver/solve_ms`, `solver/<robot>/lambda`; `control/<robot>/...` with velocities, their
    references and the virtual constraints.

    Raises MissingExtraError when rerun-sdk is not installed.
    """
    require_rerun()
    from palanquin.sim.bar import rerun_log

    rerun_log.write(record, scene, path)
