"""Things that fly or turn: quadrotor, quadrotor with a slung load, a satellite's attitude."""

import casadi as ca
import numpy as np

from palanquin import quaternion
from palanquin.integrators import integrate
from palanquin.problem import Problem
from palanquin.problems.collection.ocp import Ocp

GRAVITY = 9.81


class Quadrotor(Ocp):
    """A quadrotor flies 2 m away, up, and turns by 120 degrees about the vertical.

    Newton and Euler with semi-implicit Euler steps, v+ = v + dt (R(q) e_z sum f / m + g), p+ = p +
    dt v+, w+ = w + dt J^-1 (tau(f) - w x J w), q+ = q * exp(dt w+); p, v in the world, w in the
    body. Thrust of each rotor 0 <= f_i <= 4.5 N hard, arms of 0.17 m, drag torque 0.016 f_i.
    """

    MASS, ARM, DRAG = 1.0, 0.17, 0.016
    INERTIA = (0.0075, 0.0075, 0.013)
    TURN = (0.5, 0.0, 0.0, 0.75**0.5)
    goal = {"position": [2.0, 1.0, 1.0], "attitude": TURN}
    idle = {"thrusts": GRAVITY / 4}
    spread = {"position": 0.5, "attitude": 0.2, "velocity": 1.0, "spin": 1.0, "thrusts": 1.0}

    def build(self) -> Problem:
        problem = Problem(horizon=30, dt=0.05, name=self.name)
        p, q = problem.state("position", 3), problem.quaternion_state("attitude")
        v, w = problem.state("velocity", 3), problem.state("spin", 3)
        f = problem.input("thrusts", 4)
        up = quaternion.rotate(q, ca.vertcat(0, 0, ca.sum1(f)))
        diagonal = self.ARM / 2**0.5
        torque = ca.vertcat(
            diagonal * (f[0] + f[1] - f[2] - f[3]),
            diagonal * (-f[0] + f[1] + f[2] - f[3]),
            self.DRAG * (f[0] - f[1] + f[2] - f[3]),
        )
        inertia = ca.DM(self.INERTIA)
        dt = problem.dt
        problem.dynamics(v, increment=dt * (up / self.MASS - ca.DM([0, 0, GRAVITY])))
        problem.dynamics(p, increment=dt * problem.next(v))
        problem.dynamics(w, increment=dt * (torque - ca.cross(w, inertia * w)) / inertia)
        problem.dynamics(q, increment=dt * problem.next(w))
        error = 2 * quaternion.multiply(quaternion.conjugate(ca.SX(self.TURN)), q)[1:4]
        problem.residual("position", p - ca.DM([2.0, 1.0, 1.0]), weight=dt, at="all")
        problem.residual("attitude", error, weight=0.5 * dt, at="all")
        problem.residual("motion", ca.vertcat(v, w), weight=0.05 * dt, at="all")
        problem.residual("end", ca.vertcat(p - ca.DM([2.0, 1.0, 1.0]), error, v), weight=5.0,
                         at="terminal")  # fmt: skip
        problem.residual("thrusts", f - GRAVITY / 4, weight=0.01 * dt)
        problem.bound("thrusts", f, [0] * 4, [4.5] * 4)
        return problem


class SlungLoad(Ocp):
    """A planar quadrotor sets a hanging load down 2 m further, at rest.

    Load at r, taut rope of 1 m at angle a from hanging, body angle b. With q = (sin a, -cos a) from
    body to load, n = (cos a, sin a), thrust F = f (-sin b, cos b):

        (M + m) (r'' + g e_z) = (q . F - M a'^2) q,   M a'' = -n . F,   J b'' = tau.

    Sreenath, Lee and Kumar, "Geometric control and differential flatness of a quadrotor UAV with a
    cable-suspended load", CDC 2013, in the plane. M = 0.8, m = 0.3 kg, J = 0.01; 0 <= f_i <= 9 N
    for each of two rotors at 0.2 m, |b| <= 0.6, hard.
    """

    BODY, LOAD = 0.8, 0.3
    start = {"load": [0.0, 0.0]}
    goal = {"load": [2.0, 0.0]}
    idle = {"thrusts": (BODY + LOAD) * GRAVITY / 2}
    spread = {"load": 0.3, "angles": 0.3, "velocity": 0.5, "spins": 0.5, "thrusts": 1.0}

    def build(self) -> Problem:
        problem = Problem(horizon=40, dt=0.05, name=self.name)
        r, angles = problem.state("load", 2), problem.state("angles", 2)
        v, spins = problem.state("velocity", 2), problem.state("spins", 2)
        f = problem.input("thrusts", 2)
        following = integrate(
            lambda x: self.rate(x, f), ca.vertcat(r, angles, v, spins), problem.dt
        )
        for block, rows in ((r, [0, 1]), (angles, [2, 3]), (v, [4, 5]), (spins, [6, 7])):
            problem.dynamics(block, following[rows])
        hover = (self.BODY + self.LOAD) * GRAVITY / 2
        problem.residual("load", r - ca.DM([2.0, 0.0]), weight=problem.dt, at="all")
        problem.residual("calm", ca.vertcat(angles, v, spins), weight=0.05 * problem.dt, at="all")
        problem.residual("thrusts", f - hover, weight=0.01 * problem.dt)
        rest = ca.vertcat(r - ca.DM([2.0, 0.0]), angles, v, spins)
        problem.equality("rest", rest, at="terminal")
        problem.bound("thrusts", f, [0, 0], [9, 9])
        problem.bound("tilt", angles[1], -0.6, 0.6, at="all")
        return problem

    def rate(self, x: ca.SX, f: ca.SX) -> ca.SX:
        """Of (load, (a, b), load's velocity, (a', b'))."""
        a, b, spin = x[2], x[3], x[6]
        thrust = ca.sum1(f) * ca.vertcat(-ca.sin(b), ca.cos(b))
        along, across = ca.vertcat(ca.sin(a), -ca.cos(a)), ca.vertcat(ca.cos(a), ca.sin(a))
        pull = (ca.dot(along, thrust) - self.BODY * spin**2) / (self.BODY + self.LOAD)
        load = pull * along - ca.DM([0, GRAVITY])
        swing = -ca.dot(across, thrust) / self.BODY
        return ca.vertcat(x[4:6], x[6:8], load, swing, 0.2 * (f[1] - f[0]) / 0.01)


class Attitude(Ocp):
    """A satellite turns by 120 degrees about a skew axis with weak torques, from rest to rest.

    q' = q * w / 2, J w' = tau - w x J w, J = diag(1, 1.5, 2), |tau_i| <= 1 hard, 5 s; least squared
    torque. After Bilimoria and Wie, "Time-optimal three-axis reorientation of a rigid spacecraft",
    Journal of Guidance 16(3), 1993, with a fixed time.
    """

    ANGLE = np.deg2rad(120)
    AXIS = np.array([1.0, 2.0, 2.0]) / 3
    END = (*np.cos([ANGLE / 2]), *(np.sin(ANGLE / 2) * AXIS))
    goal = {"attitude": END}
    spread = {"attitude": 0.3, "spin": 0.3, "torque": 0.5}

    def build(self) -> Problem:
        problem = Problem(horizon=40, dt=0.125, name=self.name)
        q, w = problem.quaternion_state("attitude"), problem.state("spin", 3)
        u = problem.input("torque", 3)
        inertia, dt = ca.DM([1.0, 1.5, 2.0]), problem.dt
        problem.dynamics(w, integrate(lambda w: (u - ca.cross(w, inertia * w)) / inertia, w, dt))
        problem.dynamics(q, increment=dt / 2 * (w + problem.next(w)))
        problem.residual("effort", u, weight=dt)
        error = 2 * quaternion.multiply(quaternion.conjugate(ca.SX(self.END)), q)[1:4]
        problem.equality("arrival", ca.vertcat(error, w), at="terminal")
        problem.bound("torque", u, [-1] * 3, [1] * 3)
        return problem
