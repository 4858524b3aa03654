"""Recordings: what they hold when they are read again."""

import sys

import numpy as np
import pytest

from palanquin.problems.quaternions import normalised
from palanquin.sim.errors import MissingExtraError
from palanquin.sim.show.recording import write_recording


@pytest.fixture(scope="module")
def chunks(rollout, trajectory, tmp_path_factory):
    pytest.importorskip("rerun", reason="the extra viz is not installed")
    from rerun.chunk import RrdReader

    path = tmp_path_factory.mktemp("recording") / "run.rrd"
    write_recording(rollout, trajectory, path)
    assert path.stat().st_size < 5e6
    found = {}
    for chunk in RrdReader(str(path)).stream():
        found.setdefault(str(chunk.entity_path), []).append(chunk.to_record_batch())
    return found


def column(chunks, path, name):
    for batch in chunks[path]:
        for field in batch.schema.names:
            if field.endswith(name):
                return batch.column(field)
    raise AssertionError(f"{path} has no {name}: {[b.schema.names for b in chunks[path]]}")


def test_all_entities_are_there(chunks):
    expected = ["/world/payload", "/world/terrain", "/plan/payload", "/plan/robot1/footholds"]
    expected += ["/world/robot0/LF_calf", "/world/robot1/arm_roll", "/world/robot0/RH/force"]
    expected += ["/solver/solve_ms", "/solver/phase/solve", "/solver/violation/friction"]
    expected += ["/solver/iterations", "/solver/cost", "/solver/status"]
    expected += ["/control/payload/position_error", "/control/robot0/kinematics/hand_error"]
    assert [path for path in expected if path not in chunks] == []


def test_payload_moves_as_tracked(chunks, trajectory):
    translation = np.array(column(chunks, "/world/payload", "translation").to_pylist())
    quaternion = np.array(column(chunks, "/world/payload", "quaternion").to_pylist())
    start = trajectory.scene.model.joint("payload").qposadr[0]
    pose = trajectory.qpos[:, start : start + 7]
    np.testing.assert_allclose(translation[:, 0], pose[:, :3], atol=1e-6)
    np.testing.assert_allclose(quaternion[:, 0], normalised(pose[:, [4, 5, 6, 3]]), atol=1e-6)


def test_solver_figures_are_the_rollouts(chunks, rollout):
    times = np.array(column(chunks, "/solver/cost", "scalars").to_pylist())[:, 0]
    np.testing.assert_allclose(times, rollout.cost)


def test_swing_feet_have_no_force_arrow(chunks, rollout):
    arrows = column(chunks, "/world/robot0/LF/force", "vectors").to_pylist()
    shown = [len(entry or []) for entry in arrows]
    assert shown == rollout.contact[:, 0, 0].astype(int).tolist()


def test_missing_rerun_is_explained(rollout, trajectory, tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "rerun", None)
    for module in [name for name in sys.modules if name.startswith("palanquin.sim.show.rerun_")]:
        monkeypatch.delitem(sys.modules, module)
    import palanquin.sim.show

    monkeypatch.delattr(palanquin.sim.show, "rerun_log", raising=False)
    with pytest.raises(MissingExtraError, match=r"palanquin\[viz\]"):
        write_recording(rollout, trajectory, tmp_path / "run.rrd")
