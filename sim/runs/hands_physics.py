"""Full physics of a payload in hands: C++ steps contacts, controllers and sensors at 1 kHz."""

from __future__ import annotations

from dataclasses import replace

import mujoco
import numpy as np
from numpy.typing import NDArray

from palanquin import _sim
from palanquin.problems import quaternions
from palanquin.problems.clm.planner import Planner
from palanquin.problems.clm.references import (
    ANGULAR_VELOCITY,
    ORIENTATION,
    POSITION,
    STATE,
    VELOCITY,
)
from palanquin.problems.clm.team_plan import TeamPlan
from palanquin.problems.planning import Measurement
from palanquin.problems.robots import quadruped
from palanquin.sim.runs.breakages import Breakages
from palanquin.sim.runs.plan_link import PlanLink
from palanquin.sim.runs.simulated import SimulatedRobots, states
from palanquin.sim.scenarios.disturbance import mean_wrenches
from palanquin.sim.scenarios.limits import TIMESTEP, timesteps
from palanquin.sim.scenarios.route import payload_route
from palanquin.sim.scenarios.scenario import Scenario
from palanquin.sim.scenarios.script import Orders
from palanquin.sim.scenes.held_scene import HeldScene, build_held_scene
from palanquin.sim.scenes.inverse_kinematics import JOINTS
from palanquin.sim.scenes.members import make_member

Array = NDArray[np.float64]

LEAST_FORCE = 15.0
"""Of a foot that stands as it is due to, N: one that the plan gives none would count as lost."""

_ROLL = JOINTS.index("arm_roll")
_NO_FORCE = 1e-6


class HandsPlant(SimulatedRobots):
    """A team in MuJoCo, hands welded to the payload, each robot with its whole-body controller.

    Args:
        scenario: who carries what on what ground, from where on. Raises InputError when its period
            is no multiple of a physics step.
        planner: whose plans it will follow; with its gaits and terrain.
    """

    def __init__(self, scenario: Scenario, planner: Planner) -> None:
        steps = timesteps("a period of planner.rate", scenario.planner.period, at_least=1)
        self._planner, self._team = planner, planner.team
        self.scene = held_scene(scenario)
        data = self.scene.data()
        self._radii = [quadruped(robot.kind).foot_radius for robot in self.scene.team.robots]
        self._bodies = [
            self.scene.model.body(name).id
            for name in ("payload", *(f"{robot}/trunk" for robot in self._team.robots))
        ]
        self._payload = data.joint("payload")
        names = [[f"{robot}/{joint}" for joint in JOINTS] for robot in self._team.robots]
        self._motors = np.array([[self.scene.model.actuator(n).id for n in row] for row in names])
        simulation = _simulation(self.scene, data, scenario, planner)
        super().__init__(simulation, data, steps, len(self._team.robots), link_of(scenario))
        self._wrenches = np.zeros((len(self._team.bodies), 6))
        self._knows_truth = scenario.state == "true"
        self._held = self.scene.held_body(data)
        self._truth: dict[str, Array] = {}
        self._breakages = Breakages(
            scenario.faults, scenario.names, simulation, self.scene.model, data, self._link
        )

    def measure(self) -> Measurement:
        """Centres of mass, trunks and feet as the controllers know them, and the payload: as it
        is, or as the hands have it. What is due to break breaks before.
        """
        self.events = self._breakages.until(self.time) + self.collided()
        if not self._knows_truth:
            self._truth = self._true_state()
        seen = self.measured()
        payload = self._true_payload() if self._knows_truth else self._payload_in_hands()
        return replace(
            seen, bodies=np.vstack([payload, seen.bodies]), feet=self._on_grounds(seen.feet)
        )

    def _true_state(self) -> dict[str, Array]:
        """What is hidden from planner and controllers; see `Record`."""
        seen = [self.simulation.observe_truth(i) for i in self._robots]
        return {
            "true_bodies": np.vstack([self._true_payload(), states(seen)]),
            "true_feet": self._on_grounds(np.array([robot.feet for robot in seen])),
        }

    def _true_payload(self) -> Array:
        return np.concatenate([self._payload.qpos, self._payload.qvel])

    def _payload_in_hands(self) -> Array:
        seen = [self.simulation.observe(i) for i in self._robots]
        held = self._held.update([hand for robot in seen for hand in robot.hands])
        return np.concatenate([held.position, held.orientation, held.velocity, held.rate])

    def _on_grounds(self, feet: Array) -> Array:
        return np.array([self._on_ground(i, of_robot) for i, of_robot in enumerate(feet)])

    def _on_ground(self, robot: int, feet: Array) -> Array:
        """Contact points [4, 3] of feet that were taken to stand on level ground."""
        normals = self._planner.terrain.normal(feet[:, 0], feet[:, 1])
        return feet + self._radii[robot] * (np.array([0.0, 0.0, 1.0]) - normals)

    def apply(self, plan: TeamPlan, seen: Measurement) -> Measurement:
        """Gives each controller its target for the period from the plan's time on."""
        told = targets(self._planner, plan)
        self.send(told)
        return replace(seen, footholds=np.array([target.footholds for target in told]))

    def advance(self, period: float, orders: Orders) -> None:
        """So many physics steps as a period has, pushed; gaits change with the planner's."""
        for robot, change in orders.changes_of(self._team.robots):
            gait = change.gait.gait.core
            self.simulation.change_gait(robot, gait, self.time, change.at_once)
        times = np.array([self.time])
        self._wrenches = mean_wrenches(orders.pushes, self._team.bodies, times, period)[0]
        self._push()
        self.step()

    def _push(self) -> None:
        """At the bodies' centres of mass; MuJoCo takes forces at those of links."""
        if not (self._wrenches.any() or self.data.xfrc_applied.any()):
            return
        centres = [self.data.xipos[self._bodies[0]]]
        centres += [self.simulation.observe_truth(i).position for i in self._robots]
        for body, centre, wrench in zip(self._bodies, centres, self._wrenches, strict=True):
            arm = centre - self.data.xipos[body]
            torque = wrench[3:] + np.cross(arm, wrench[:3])
            self.data.xfrc_applied[body] = np.concatenate([wrench[:3], torque])

    def values(self) -> dict[str, Array]:
        """As of `SimulatedRobots`, torques at the last period's end, the mean wrench of all pushes
        on each body, and where the state is not known what truly was at its start, and the
        forces that feet were taken to feel at its end.
        """
        shares = self._torque_share()
        own = {"torque_share": shares, "disturbance": self._wrenches, **self._truth}
        if not self._knows_truth:
            known = [self.simulation.known_forces(i) for i in self._robots]
            own["known_force"] = np.array(known)
        return {**super().values(), **own}

    def _torque_share(self) -> Array:
        """Torques over their limits [R, 16], joints in the order of `JOINTS`."""
        return (self.data.ctrl / self.scene.model.actuator_ctrlrange[:, 1])[self._motors]

    def extremes(self) -> dict[str, float]:
        """Of all physics steps so far."""
        worst = self.simulation.extremes
        return {
            **super().extremes(),
            "contact_force_n": worst.contact_force,
            "slip_m": worst.slip,
            "collisions": worst.collisions,
            "lost_plans": self._link.lost,
            "oldest_plan_s": self._link.oldest * TIMESTEP,
        }


def held_scene(scenario: Scenario) -> HeldScene:
    """The scene of a scenario at its start, with ground all the way."""
    world, route = scenario.world, payload_route(scenario)
    return build_held_scene(
        scenario.scene, scenario.start_state(), world.friction, route, world.robot_mass
    )


def link_of(scenario: Scenario) -> PlanLink[list[_sim.RobotTarget]]:
    """As late and as lossy as the scenario says; raises InputError for a part of a step."""
    settings = scenario.planner
    latency = timesteps("planner.latency", settings.latency)
    return PlanLink(latency, settings.lost, scenario.seed)


def targets(planner: Planner, plan: TeamPlan) -> list[_sim.RobotTarget]:
    """What the controllers are given: the plan's first knot, which is the measurement, and how it
    moves on. Accelerations are those over the plan's first interval.
    """
    states, rates = plan.bodies[0], (plan.bodies[1] - plan.bodies[0])[:, VELOCITY.start : STATE]
    rates = rates / planner.dt
    result = []
    for i, carrier in enumerate(planner.team.carriers):
        state, rate = states[i + 1], rates[i + 1]
        target = _sim.RobotTarget()
        target.time = plan.time
        target.position, target.velocity = state[POSITION], state[VELOCITY]
        target.orientation, target.rate = state[ORIENTATION], state[ANGULAR_VELOCITY]
        target.acceleration, target.rate_derivative = rate[:3], rate[3:]
        target.commanded_velocity = state[VELOCITY]
        target.forces = _forces(plan, i)
        target.footholds = landing = footholds(plan, i)
        feet = np.where(np.isfinite(landing), landing, plan.feet[0, i])
        target.normals = planner.terrain.normal(feet[:, 0], feet[:, 1])
        target.hands = [_hand(states[0], rates[0], np.array(carrier.attach), plan, i)]
        result.append(target)
    return result


def _forces(plan: TeamPlan, robot: int) -> Array:
    """Of the ground on the feet [4, 3]; of one that lands at this very instant the next knot's."""
    first, second = plan.forces[0, robot], plan.forces[1, robot]
    lands = plan.contacts[0, robot] & (np.abs(first).max(axis=1) < _NO_FORCE)
    return np.where(lands[:, None], second, first)


def footholds(plan: TeamPlan, robot: int) -> Array:
    """Where feet that are in the air will land [4, 3]; NaN of others and beyond the horizon."""
    stands = plan.contacts[:-1, robot]
    landing = plan.feet[stands.argmax(axis=0), robot, np.arange(stands.shape[1])]
    will_land = ~stands[0] & stands.any(axis=0)
    return np.where(will_land[:, None], landing, np.nan)


def _hand(
    payload: Array, rate: Array, attach: Array, plan: TeamPlan, robot: int
) -> _sim.HandTarget:
    """The grasp point's motion, and the payload's planned wrench on the hand."""
    orientation = payload[ORIENTATION]
    arm = quaternions.rotate(orientation, attach)
    spin = quaternions.rotate(orientation, payload[ANGULAR_VELOCITY])
    turning = quaternions.rotate(orientation, rate[3:])
    hand = _sim.HandTarget()
    point = _sim.PointTarget()
    point.position = payload[POSITION] + arm
    point.velocity = payload[VELOCITY] + np.cross(spin, arm)
    point.acceleration = rate[:3] + np.cross(turning, arm) + np.cross(spin, np.cross(spin, arm))
    wrench = _sim.Wrench()
    wrench.force, wrench.moment = np.split(plan.hand_wrenches[0, robot], 2)
    hand.point, hand.wrench = point, wrench
    return hand


def _simulation(
    scene: HeldScene, data: mujoco.MjData, scenario: Scenario, planner: Planner
) -> _sim.TeamSimulation:
    members = []
    for index, carrier in enumerate(planner.team.carriers):
        seed = scenario.seed + index
        control = _sim.RobotControlSettings()
        control.gait = carrier.gait.core
        control.friction = scenario.world.friction
        control.least_force, control.posture = LEAST_FORCE, [_ROLL]
        robot, hips = scene.descriptions[carrier.name], np.array(carrier.model.hips)
        noise = _sim.MeasurementSettings()
        if scenario.state == "noisy":
            noise = scenario.sensors.measurement(seed)
        member = make_member(scene.model, carrier.name, JOINTS, robot, hips, control, noise)
        if scenario.state == "estimated":
            member.estimation = scenario.sensors.estimation(seed)
        members.append(member)
    payload = int(scene.model.body("payload").id)
    return _sim.TeamSimulation(
        scene.model, data, members, keep_off=[payload], bars=[], disturbances=[]
    )
