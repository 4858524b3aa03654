"""Joint angles that put an armed quadruped's feet and hand where they should be (Pinocchio)."""

import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from palanquin.problems.robots import DYNAARM, FEET, QuadrupedModel
from palanquin.sim.scenes.arm import JOINTS as ARM_JOINTS
from palanquin.sim.scenes.quadruped import armed_quadruped

Array = NDArray[np.float64]

LEG_JOINTS = tuple(f"{foot}_{name}" for foot in FEET for name in ("hip", "thigh", "calf"))
JOINTS = LEG_JOINTS + ARM_JOINTS
"""Order of the 16 joint angles: hip, thigh, calf of LF, RF, LH, RH, then the arm's four."""

# Where the search starts: knees behind the hips, elbow up.
_CROUCH = (0.0, 0.95, -1.9)
_REACH = (0.0, 0.85, 2.4)
_RESTARTS = 12


@dataclass(frozen=True)
class JointSolution:
    """Result of an inverse-kinematics solve.

    `angles` [16] in the order of `JOINTS` (rad), always within limits; `error` [5] distances (m)
    of LF, RF, LH, RH and hand from their targets; `at_limit` [16] true where an angle sits on its
    limit.
    """

    angles: Array
    error: Array
    at_limit: NDArray[np.bool_]


class InverseKinematics:
    """Solves the five limbs of one robot, each three joints to a point, by Levenberg-Marquardt.

    The arm's fourth joint, the forearm's roll, leaves the hand where it is and turns it about the
    forearm: it is set last, so that the hand's y axis is as near as it can be to the wanted one.
    """

    def __init__(
        self, model: QuadrupedModel, tolerance: float = 1e-9, iterations: int = 40
    ) -> None:
        self._pin = pinocchio_model(model)
        self._data = self._pin.createData()
        self._tolerance, self._iterations = tolerance, iterations
        names = list(self._pin.names)
        joints = [self._pin.joints[names.index(name)] for name in JOINTS]
        self._q_index = np.array([joint.idx_q for joint in joints])
        self._v_index = np.array([joint.idx_v for joint in joints])
        # The limits of our own facts: the MJCF text has them rounded to six digits.
        facts = [model.leg_joint(name[:2], name[3:]) for name in LEG_JOINTS]
        facts += DYNAARM.joints.values()
        self.lower = np.array([joint.lower for joint in facts])
        self.upper = np.array([joint.upper for joint in facts])
        self._frames = [self._pin.getFrameId(name) for name in (*FEET, "hand")]
        self._limbs = np.arange(15).reshape(5, 3)
        self.middle = np.array(4 * _CROUCH + (*_REACH, 0.0))
        # Other poses to start from when a limb gets stuck: the same for every solve.
        low, high = np.maximum(self.lower, -np.pi), np.minimum(self.upper, np.pi)
        self._restarts = np.random.default_rng(0).uniform(low, high, (_RESTARTS, len(JOINTS)))

    def place(self, position: Array, quaternion: Array, angles: Array) -> Array:
        """World positions [5, 3] (m) of LF, RF, LH, RH (sphere centres) and hand, for a trunk at
        `position` [3] with orientation `quaternion` (w, x, y, z) and joint `angles` [16].
        """
        q = self._configuration(position, quaternion, angles)
        pin.forwardKinematics(self._pin, self._data, q)
        pin.updateFramePlacements(self._pin, self._data)
        return np.array([self._data.oMf[frame].translation for frame in self._frames])

    def solve(
        self,
        position: Array,
        quaternion: Array,
        targets: Array,
        hand_y: Array | None = None,
        start: Array | None = None,
    ) -> JointSolution:
        """Angles that bring the feet and the hand to `targets` [5, 3] (world, m).

        `hand_y` [3] is the wanted y axis of the hand (world), `start` [16] where to begin, best
        the previous instant's angles. A target out of reach gives the nearest point found and
        its honest error.
        """
        angles = self.middle if start is None else np.clip(start, self.lower, self.upper)
        angles, error = self._search(position, quaternion, targets, angles)
        for fresh in self._restarts:
            if np.all(error <= 1e3 * self._tolerance):
                break
            found, found_error = self._search(position, quaternion, targets, fresh)
            for limb in np.flatnonzero(found_error < 0.9 * error):
                angles[self._limbs[limb]] = found[self._limbs[limb]]
                error[limb] = found_error[limb]
        if hand_y is not None:
            angles[15] = self._roll(position, quaternion, angles, hand_y)
        at_limit = (angles <= self.lower + 1e-9) | (angles >= self.upper - 1e-9)
        return JointSolution(angles, error, at_limit)

    def _search(
        self, position: Array, quaternion: Array, targets: Array, start: Array
    ) -> tuple[Array, Array]:
        """Levenberg-Marquardt on every limb at once, each with its own damping, projected onto
        the limits.
        """
        angles = start.copy()
        offset = targets - self.place(position, quaternion, angles)
        error = np.linalg.norm(offset, axis=1)
        damping = np.full(5, 1e-6)
        for _ in range(self._iterations):
            if np.all(error < self._tolerance) or np.all(damping > 1e6):
                break
            jacobian = self._jacobians(position, quaternion, angles)
            transpose = np.swapaxes(jacobian, 1, 2)
            normal = transpose @ jacobian + damping[:, None, None] * np.eye(3)
            step = np.linalg.solve(normal, transpose @ offset[:, :, None])[:, :, 0]
            trial = angles.copy()
            trial[:15] += np.clip(step, -0.5, 0.5).ravel()
            trial = np.clip(trial, self.lower, self.upper)
            trial_offset = targets - self.place(position, quaternion, trial)
            trial_error = np.linalg.norm(trial_offset, axis=1)
            better = trial_error < error
            for limb in np.flatnonzero(better):
                angles[self._limbs[limb]] = trial[self._limbs[limb]]
            offset = np.where(better[:, None], trial_offset, offset)
            error = np.where(better, trial_error, error)
            damping = np.where(better, np.maximum(damping / 10, 1e-12), damping * 10)
        return angles, error

    def _jacobians(self, position: Array, quaternion: Array, angles: Array) -> Array:
        """Jacobians [5, 3, 3] of the limbs' points with respect to their own three joints."""
        q = self._configuration(position, quaternion, angles)
        pin.computeJointJacobians(self._pin, self._data, q)
        pin.updateFramePlacements(self._pin, self._data)
        world = pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
        result = np.empty((5, 3, 3))
        for limb, frame in enumerate(self._frames):
            jacobian = pin.getFrameJacobian(self._pin, self._data, frame, world)
            result[limb] = jacobian[:3, self._v_index[self._limbs[limb]]]
        return result

    def _roll(self, position: Array, quaternion: Array, angles: Array, hand_y: Array) -> float:
        flat = angles.copy()
        flat[15] = 0.0
        self.place(position, quaternion, flat)
        rotation = self._data.oMf[self._frames[4]].rotation
        wanted = rotation.T @ hand_y
        if np.hypot(wanted[0], wanted[1]) < 1e-9:  # along the forearm: any roll is as good
            return float(angles[15])
        # A roll by a turns the hand's y axis to (-sin a, cos a, 0). A hand has no up side: the
        # smaller of the two rolls that align the axis is taken.
        roll = np.arctan2(-wanted[0], wanted[1])
        return float((roll + np.pi / 2) % np.pi - np.pi / 2)

    def _configuration(self, position: Array, quaternion: Array, angles: Array) -> Array:
        """Pinocchio's q: position, quaternion as (x, y, z, w), joint angles."""
        q = np.empty(self._pin.nq)
        q[:3] = position
        q[3:6], q[6] = quaternion[1:], quaternion[0]
        q[self._q_index] = angles
        return q


def pinocchio_model(model: QuadrupedModel) -> pin.Model:
    """One armed quadruped read by Pinocchio from the MJCF that MuJoCo simulates.

    One robot a file: of a file with several, Pinocchio reads the first tree only, silently.
    """
    spec = armed_quadruped(model, visual=False)
    spec.compile()
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "robot.xml"
        path.write_text(spec.to_xml())
        return pin.buildModelFromMJCF(str(path))
