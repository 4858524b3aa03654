"""The demos of a payload in hands: full physics, or the nominal model and inverse kinematics."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from rich.table import Table

from palanquin.cli.console import err
from palanquin.cli.demo_files import PICTURE_SHARE
from palanquin.cli.watching import Bars, show_failed_plan
from palanquin.problems.clm.planner import Planner
from palanquin.sim.runs.hands_physics import held_scene
from palanquin.sim.runs.record import Record
from palanquin.sim.runs.scenarios import loop_of
from palanquin.sim.scenarios import Scenario
from palanquin.sim.scenes.scene import Scene
from palanquin.sim.show.clearance import clearance_figures
from palanquin.sim.show.joint_motion import JointMotion
from palanquin.sim.show.kinematic import track
from palanquin.sim.show.recording import write_recording
from palanquin.sim.show.render import Motion, planned_motion


class HandsDemo:
    """As of `Shown`, whoever moves the joints."""

    def __init__(self, scenario: Scenario) -> None:
        self._scenario = scenario
        self._planner: Planner
        self._record: Record
        self._motion: JointMotion[Scene]

    def run(self, progress: Bars) -> Record:
        """Plans live, then finds the joints' motion."""
        self._planner = self._scenario.build_planner()
        loop = loop_of(self._scenario, self._planner)
        self._record = loop.run(progress("walking", loop.most))
        self._motion = self.find_motion(progress)
        return self._record

    def find_motion(self, progress: Bars) -> JointMotion[Scene]:
        """Of the joints, from the record."""
        raise NotImplementedError

    def settings(self) -> dict[str, Any]:
        """Gait, command, horizon and solver."""
        scenario, planner = self._scenario, self._planner
        gaits = [robot.gait.name for robot in scenario.robots]
        first = scenario.command.start().velocity(0.0, planner.reference, scenario.planner.period)
        settings = planner.sqp.settings
        return {
            "gait": gaits[0] if len(set(gaits)) == 1 else gaits,
            "gait_changes": len(scenario.gait_changes),
            "velocity": [first.vx, first.vy, first.wz],
            "command": scenario.command.model_dump(mode="json"),
            "horizon": planner.horizon,
            "dt_s": planner.dt,
            "rate_hz": scenario.planner.rate,
            "state": scenario.state,
            "qp": settings.qp,
            "sqp_iterations_per_period": settings.max_iterations,
            "threads": settings.threads,
            "candidates": scenario.planner.candidates,
        }

    def more_figures(self) -> dict[str, Any]:
        """Distances from obstacles."""
        return {"clearance": clearance_figures(self._motion)} if self._scenario.obstacles else {}

    def record(self, path: Path) -> None:
        """Bodies, plan, solver and tracking."""
        write_recording(self._record, self._motion, path)

    def motion(self) -> Motion:
        """With the plan of the time."""
        return planned_motion(self._motion, self._record)

    def picture_share(self) -> float:
        """In the middle of what pushes, or else under way."""
        record = self._record
        pushed = np.flatnonzero(record.more["disturbance"].any(axis=(1, 2)))
        if not len(pushed) or record.time[-1] == 0:
            return PICTURE_SHARE
        return float(record.time[pushed[len(pushed) // 2]] / record.time[-1])

    def table(self, figures: dict[str, Any]) -> Table:
        """Errors, violations, times, events."""
        gaits = dict.fromkeys(robot.gait.name for robot in self._scenario.robots)
        title = f"{self._scenario.name}: {figures['robots']} robots, {', '.join(gaits)}"
        error = figures["payload_position_error_m"]
        table = Table(title=title, show_header=False)
        table.add_row("completed", "yes" if figures["completed"] else "no")
        table.add_row(
            "duration, distance", f"{figures['duration_s']:.1f} s, {figures['distance_m']:.2f} m"
        )
        table.add_row(
            "payload position error after 1 s",
            f"rms {1e3 * error['rms']:.3g} mm, max {1e3 * error['max']:.3g} mm",
        )
        table.add_row("worst violation (m, 100 N)", _listed(figures["violation"], ".2g"))
        if "clearance" in figures:
            distances = {kind: least["distance_m"] for kind, least in figures["clearance"].items()}
            table.add_row("smallest distances, m", _listed(distances, ".3f"))
        table.add_row("time of a plan, ms", _listed(figures["solve_ms"], ".2f"))
        table.add_row("the solver's part, ms", _listed(figures["solver_ms"], ".2f"))
        missed = f"{figures['deadline_misses']}, {figures['fallbacks']}"
        table.add_row("deadline misses, fallbacks", missed)
        for title, text in self.rows(figures):
            table.add_row(title, text)
        events = {name: count for name, count in figures["events"].items() if count > 0}
        table.add_row("events", _listed(events, "d") if events else "none: full steps throughout")
        return table

    def rows(self, figures: dict[str, Any]) -> list[tuple[str, str]]:
        """Of the table, what only one of the demos has."""
        return []

    def explain_failure(self, figures: dict[str, Any]) -> None:
        """A fall or a plan that diverged, and the plan with which it began."""
        why = figures["fall"]["cause"] if figures["fell"] else "the plan diverged"
        err.print(f"not completed: {why}", markup=False)
        show_failed_plan(self._planner)


class KinematicDemo(HandsDemo):
    """The nominal model, shown by inverse kinematics."""

    def find_motion(self, progress: Bars) -> JointMotion[Scene]:
        """By inverse kinematics."""
        self._joints = track(self._record, progress=progress("tracking", 1.0))
        return self._joints

    def more_figures(self) -> dict[str, Any]:
        """Of the inverse kinematics too."""
        return {"kinematics": self._joints.summary(), **super().more_figures()}


class PhysicsDemo(HandsDemo):
    """Robots with controllers in simulated physics."""

    def find_motion(self, progress: Bars) -> JointMotion[Scene]:
        """As simulated."""
        scene = held_scene(self._scenario).scene
        return JointMotion(scene, self._record.time, self._record.more["qpos"])

    def rows(self, figures: dict[str, Any]) -> list[tuple[str, str]]:
        """Torques, slip, controllers."""
        touched = figures["touchdowns"]
        torque, at_limit = figures["torque_fraction_max"], figures["saturated_share"]
        return [
            ("largest torque", f"{torque:.0%} of its limit, at which {at_limit:.2%} were"),
            ("slip of a foot", f"at most {1e3 * figures['slip_m']:.2g} mm"),
            ("touchdowns, in ditches", f"{touched['count']}, {touched['in_ditches']}"),
            ("collisions", _of_collisions(figures["collisions"])),
            ("a robot's controller, mean", f"{1e3 * figures['control_ms_mean']:.0f} us"),
            *_of_estimates(figures),
            ("fallbacks of controllers", f"{figures['control_fallbacks']}"),
            *((f"at {fault['time_s']:.2f} s", fault["what"]) for fault in figures["faults"]),
            ("faster than real time", f"{figures['real_time_factor']:.2f} times"),
        ]


def _of_estimates(figures: dict[str, Any]) -> list[tuple[str, str]]:
    return [
        (
            f"estimate of {who}, rms",
            f"{1e3 * error['position_rms']:.2g} mm, {1e3 * error['orientation_rms']:.2g} mrad, "
            f"{1e3 * error['velocity_rms']:.2g} mm/s",
        )
        for who, error in figures.get("estimation_error", {}).items()
    ]


def _of_collisions(figures: dict[str, Any]) -> str:
    first = figures["first"]
    if first is None:
        return "none"
    return f"{figures['steps']} ms, first at {first['time_s']:.2f} s: {first['what']}"


def _listed(values: dict[str, float], form: str) -> str:
    return ", ".join(f"{name} {value:{form}}" for name, value in values.items())
