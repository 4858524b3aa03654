"""The MuJoCo scene in which hands hold the payload, for physics."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from palanquin import _sim
from palanquin.problems.clm.team_plan import TeamState
from palanquin.problems.quaternions import rotate
from palanquin.problems.robots import quadruped
from palanquin.sim.scenarios.team import Team
from palanquin.sim.scenes.links import COLLISION_GROUP
from palanquin.sim.scenes.quadruped import armed_quadruped
from palanquin.sim.scenes.robot_description import describe_robot
from palanquin.sim.scenes.robot_poser import RobotPoser
from palanquin.sim.scenes.scene import Scene, build_scene, joint_slice

Array = NDArray[np.float64]

_HOLD_SOLREF = (0.004, 1.0)
"""Time constant (s) and damping of the weld between hand and payload: four physics steps."""


@dataclass(frozen=True)
class HeldScene:
    """A scene whose hands are welded to the payload at their grasp points, turned as they are at
    the start: equality `hold/<robot>` between the sites `<robot>/hand` and `hold/<robot>`.

    `start` [nq] and `motion` [nv] are its configuration and velocities there, `descriptions` what
    the robots' controllers know of them, by name.
    """

    scene: Scene
    start: Array
    motion: Array
    descriptions: dict[str, _sim.RobotDescription]

    @property
    def team(self) -> Team:
        """Who is in it."""
        return self.scene.team

    @property
    def model(self) -> mujoco.MjModel:
        """The compiled scene."""
        return self.scene.model

    def data(self) -> mujoco.MjData:
        """A fresh state at the start."""
        data = mujoco.MjData(self.model)
        data.qpos[:], data.qvel[:] = self.start, self.motion
        return data

    def held_body(self, data: mujoco.MjData) -> _sim.HeldBody:
        """The payload as its hands tell of it, held as it is in `data`."""
        mujoco.mj_kinematics(self.model, data)
        payload, grips = data.body("payload"), []
        for robot in self.team.robots:
            hand = data.site(f"{robot.name}/hand")
            link = data.body(int(self.model.site(f"{robot.name}/hand").bodyid[0]))
            grips.append(_sim.Grip(*_within(payload, hand.xpos, link.xmat)))
        return _sim.HeldBody(grips)


def build_held_scene(
    team: Team,
    state: TeamState,
    friction: float,
    path: Array | None = None,
    robot_mass: float = 1.0,
) -> HeldScene:
    """The scene of `team` where its bodies and feet are at `state`.

    Args:
        team: robots, payload, ground.
        state: where and how fast the run begins; joints are at rest against their trunks.
        friction: the ground's sliding coefficient.
        path: positions that the ground must reach beyond, see `build_scene`.
        robot_mass: of the robots' links, as a share of what their controllers know.
    """
    bare = build_scene(team, path, friction)
    start = _pose(bare, state)
    data = mujoco.MjData(bare.model)
    data.qpos[:] = start
    mujoco.mj_kinematics(bare.model, data)
    spec = bare.spec
    # A state that is not finite ends the run instead of starting over at the origin.
    spec.option.disableflags |= mujoco.mjtDisableBit.mjDSBL_AUTORESET
    for robot in team.robots:
        _hold(spec, robot.name, data)
    model = spec.compile()  # sites and welds leave the configuration's layout as it was
    if robot_mass != 1.0:
        _scale_robots(model, team, robot_mass)
    alone = {
        kind: describe_robot(armed_quadruped(quadruped(kind), visual=False))
        for kind in {robot.kind for robot in team.robots}
    }
    return HeldScene(
        Scene(team, spec, model),
        start,
        _velocities(model, team, state),
        {robot.name: alone[robot.kind] for robot in team.robots},
    )


def _scale_robots(model: mujoco.MjModel, team: Team, share: float) -> None:
    """Gives the links of all robots this share of their masses and inertias."""
    prefixes = tuple(f"{name}/" for name in team.names)
    for body in range(model.nbody):
        if model.body(body).name.startswith(prefixes):
            model.body_mass[body] *= share
            model.body_inertia[body] *= share
    mujoco.mj_setConst(model, mujoco.MjData(model))


def _pose(scene: Scene, state: TeamState) -> Array:
    """The configuration [nq] with bodies and feet at `state` and hands on their grasp points."""
    qpos = scene.model.qpos0.copy()
    payload = state.bodies[0, :7]
    qpos[joint_slice(scene.model, "payload", 7)] = payload
    for i in range(len(scene.team.robots)):
        RobotPoser(scene, i).pose(qpos, state.bodies[i + 1, :7], state.feet[i], payload)
    return qpos


def _velocities(model: mujoco.MjModel, team: Team, state: TeamState) -> Array:
    """Velocities [nv] of the free bodies, whose states' are of their centres of mass."""
    motion = np.zeros(model.nv)

    def move(joint: str, body: Array, centre: Array) -> None:
        arm = rotate(body[3:7], centre)
        spin = rotate(body[3:7], body[10:13])
        first = int(model.joint(joint).dofadr[0])
        motion[first : first + 6] = [*(body[7:10] - np.cross(spin, arm)), *body[10:13]]

    move("payload", state.bodies[0], np.zeros(3))
    for robot, body in zip(team.robots, state.bodies[1:], strict=True):
        move(f"{robot.name}/free", body, np.asarray(robot.body.centre_of_mass))
    return motion


def _hold(spec: mujoco.MjSpec, robot: str, data: mujoco.MjData) -> None:
    """Welds a hand to the payload where and how it is in `data`."""
    hand = data.site(f"{robot}/hand")
    position, turn = _within(data.body("payload"), hand.xpos, hand.xmat)
    spec.body("payload").add_site(
        name=f"hold/{robot}",
        pos=position,
        quat=turn,
        size=[0.01, 0, 0],
        group=COLLISION_GROUP,
    )
    spec.add_equality(
        name=f"hold/{robot}",
        type=mujoco.mjtEq.mjEQ_WELD,
        objtype=mujoco.mjtObj.mjOBJ_SITE,
        name1=f"{robot}/hand",
        name2=f"hold/{robot}",
        solref=_HOLD_SOLREF,
    )


def _within(body: Any, position: Array, rotation: Array) -> tuple[Array, Array]:
    """A frame of the world in a body's: position and quaternion."""
    back, turn = body.xmat.reshape(3, 3).T, np.zeros(4)
    mujoco.mju_mat2Quat(turn, (back @ rotation.reshape(3, 3)).ravel())
    return back @ (position - body.xpos), turn
