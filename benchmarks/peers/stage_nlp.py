"""A `Problem` as one nonlinear program in CasADi, from the expressions that we lower ourselves.

Variables are ambient (quaternions have four entries, kept at unit norm by the dynamics), penalties
are part of the objective, hard rows are constraints, dynamics are explicit. Blocks that are absent
at a knot are left out, rows that are inactive too, so that a program belongs to one sequence of
contacts.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np

from palanquin import lowering
from palanquin.benchmarks.peers import penalties
from palanquin.benchmarks.peers.instance import Instance, linked_blocks
from palanquin.policies import Hard
from palanquin.problem import Block, Problem, Role, RowGroup

ROW_KINDS = ("equality", "link", "inequality")


@dataclass(frozen=True)
class StageNlp:
    """min f(w, p) s.t. g(w, p) = 0, or <= 0 where a row is no equality, stage by stage.

    The variables are w = (s_0, u_0, s_1, .., s_N).

    Rows of stage k are the dynamics to k + 1 and then its own rows. With `carried` blocks the state
    s_k is (x_k, those blocks at knot k - 1), so that rows over two knots become rows of one stage.

    Attributes:
        nlp: {"x", "p", "f", "g"} for `casadi.nlpsol`.
        nx: size of s_k, [N + 1].
        nu: size of u_k, [N + 1], the last one 0.
        ng: number of rows of stage k besides the dynamics, [N + 1].
        equality: which rows of g are equalities.
    """

    nlp: dict[str, ca.SX]
    nx: list[int]
    nu: list[int]
    ng: list[int]
    equality: list[bool]
    _columns: list[np.ndarray]  # per knot, which columns of z the stage's s and u hold
    _carried: np.ndarray  # columns of z that s_k holds for knot k - 1
    _states: np.ndarray
    _known: np.ndarray  # those of them that are measured at knot 0

    @property
    def lower(self) -> np.ndarray:
        """Lower bounds of g; the upper ones are 0."""
        return np.where(self.equality, 0.0, -np.inf)

    def start(self, instance: Instance) -> np.ndarray:
        """Point w of the instance's guess, with the measured state at knot 0."""
        z = self._with_measured_state(instance)
        previous = np.vstack([instance.measured.values, z[:-1]])
        parts = []
        for k, columns in enumerate(self._columns):
            parts += [z[k, self._states], previous[k, self._carried], z[k, columns]]
        return np.concatenate(parts)

    def parameters(self, instance: Instance) -> np.ndarray:
        """Vector p: all knots' parameters, then the measured knot."""
        return np.concatenate([instance.params.values.ravel(), instance.measured.values])

    def trajectory(self, w: np.ndarray, instance: Instance) -> np.ndarray:
        """Knot vectors [N + 1, nz] of a point w."""
        z = np.zeros_like(instance.guess.values)
        offset = 0
        for k, columns in enumerate(self._columns):
            z[k, self._states] = w[offset : offset + len(self._states)]
            offset += self.nx[k]
            z[k, columns] = w[offset : offset + len(columns)]
            offset += len(columns)
        # The last knot has states only; other blocks keep their guess, which nothing looks at.
        inputs = np.setdiff1d(np.arange(z.shape[1]), self._states)
        z[-1, inputs] = instance.guess.values[-1, inputs]
        return z

    def _with_measured_state(self, instance: Instance) -> np.ndarray:
        z = instance.guess.values.copy()
        z[0, self._known] = instance.measured.values[self._known]
        return z


def build_stage_nlp(problem: Problem, instance: Instance, carry: bool) -> StageNlp:
    """The program for the contacts of `instance`.

    Args:
        problem: what was lowered.
        instance: its flags say which blocks and rows there are.
        carry: put blocks that meet the knot before into the state, for solvers by stages.
    """
    return _Builder(problem, instance, carry).build()


class _Builder:
    def __init__(self, problem: Problem, instance: Instance, carry: bool) -> None:
        self.problem = problem
        self.knot = lowering.knot_symbols(problem)
        self.horizon = len(instance.params.values) - 1
        self.blocks = problem.blocks
        self.offsets = np.cumsum([0, *(b.size for b in self.blocks)])
        self.nz = int(self.offsets[-1])
        self.states = self._columns_of([b for b in self.blocks if b.is_state])
        self.roles, self.active = self._structure(instance)
        given = zip(self.blocks, self.roles[0], strict=True)
        self.known = self._columns_of([b for b, r in given if b.is_state and r != Role.INPUT])
        self.carried = self._columns_of(linked_blocks(problem, instance) if carry else [])
        self.p = ca.SX.sym("p", *instance.params.values.T.shape)
        self.measured = ca.SX.sym("measured", self.nz)
        self.functions = self._functions()

    def build(self) -> StageNlp:
        columns = [self._inputs_at(k) for k in range(self.horizon)] + [np.array([], dtype=int)]
        s = [ca.SX.sym(f"s{k}", len(self.states) + len(self.carried)) for k in range(len(columns))]
        u = [ca.SX.sym(f"u{k}", len(c)) for k, c in enumerate(columns)]
        z = [self._knot(s[k], u[k], columns[k]) for k in range(len(columns))]
        rows: list[tuple[ca.SX, bool]] = []
        cost, ng = ca.SX(0), []
        for k in range(self.horizon + 1):
            p, at = self.p[:, k], "running" if k < self.horizon else "terminal"
            if at == "running":
                following = ca.vertcat(self.functions["d"](z[k], p), z[k][self.carried.tolist()])
                rows.append((s[k + 1] - following, True))
            own = self._rows(k, at, s, z)
            rows += own
            ng.append(sum(value.numel() for value, _ in own))
            cost += self.functions[at](z[k], p)
        return StageNlp(
            nlp={
                "x": ca.vertcat(*(part for pair in zip(s, u, strict=True) for part in pair)),
                "p": ca.vertcat(ca.vec(self.p), self.measured),
                "f": cost,
                "g": ca.vertcat(*(value for value, _ in rows)),
            },
            nx=[part.numel() for part in s],
            nu=[part.numel() for part in u],
            ng=ng,
            equality=[is_equality for value, is_equality in rows for _ in range(value.numel())],
            _columns=columns,
            _carried=self.carried,
            _states=self.states,
            _known=self.known,
        )

    def _columns_of(self, blocks: list[Block]) -> np.ndarray:
        chosen = {b.name for b in blocks}
        ranges = [
            np.arange(self.offsets[i], self.offsets[i + 1])
            for i, b in enumerate(self.blocks)
            if b.name in chosen
        ]
        return np.concatenate(ranges) if ranges else np.array([], dtype=int)

    def _structure(self, instance: Instance) -> tuple[np.ndarray, dict[tuple[str, str], Any]]:
        """Roles [N + 1, blocks], and per kind and place the flags [N + 1, groups]."""
        by_name = {f.name(): f for f in lowering.value_functions(self.problem)}
        roles, _, *flags = by_name["structure"](instance.params.values.T)
        places = [
            ("equality", "running"),
            ("inequality", "running"),
            ("link", "running"),
            ("equality", "terminal"),
            ("inequality", "terminal"),
        ]
        active = {place: np.asarray(f).T for place, f in zip(places, flags, strict=True)}
        return np.asarray(roles).T, active

    def _inputs_at(self, k: int) -> np.ndarray:
        present = [
            b
            for b, role in zip(self.blocks, self.roles[k], strict=True)
            if not b.is_state and role != Role.ABSENT
        ]
        return self._columns_of(present)

    def _knot(self, s: ca.SX, u: ca.SX, columns: np.ndarray) -> ca.SX:
        z = ca.SX.zeros(self.nz)
        z[self.states.tolist()] = s[: len(self.states)]
        z[columns.tolist()] = u
        return z

    def _functions(self) -> dict[str, ca.Function]:
        k, problem = self.knot, self.problem
        stage = [k.z, k.p]
        functions = {"d": ca.Function("d", stage, [lowering.explicit_next_state(problem)])}
        for at in ("running", "terminal"):
            cost = lowering.total_cost(problem, at)
            for group in lowering.groups_at(problem, "inequality", at):
                if not isinstance(group.policy, Hard):
                    cost += group.active * ca.sum1(penalties.value(group, group.expression))
            functions[at] = ca.Function(at, stage, [cost])
            for kind in ROW_KINDS:
                rows = [g.expression for g in self._groups(kind, at)]
                name = f"{kind}_{at}"
                functions[name] = ca.Function(name, [k.z_previous, k.z, k.p], rows)
        return functions

    def _groups(self, kind: str, at: str) -> list[RowGroup]:
        """Groups of rows; those over two knots hold at running knots alone."""
        is_there = kind != "link" or at == "running"
        return lowering.groups_at(self.problem, kind, at) if is_there else []

    def _rows(self, k: int, at: str, s: list[ca.SX], z: list[ca.SX]) -> list[tuple[ca.SX, bool]]:
        """The initial state at knot 0, and the active rows of knot k; whether each is an equality.

        Penalised rows are part of the cost and do not appear.
        """
        rows: list[tuple[ca.SX, bool]] = []
        if k == 0:
            kept = np.concatenate([self.states, self.carried])
            is_known = np.isin(kept, np.concatenate([self.known, self.carried]))
            own = np.flatnonzero(is_known).tolist()
            rows.append((s[0][own] - self.measured[kept[is_known].tolist()], True))
        previous = self.measured if k == 0 else z[k - 1]
        if len(self.carried):
            previous = ca.SX(previous)
            previous[self.carried.tolist()] = s[k][len(self.states) :]
        for kind in ROW_KINDS:
            groups = self._groups(kind, at)
            values = self.functions[f"{kind}_{at}"].call([previous, z[k], self.p[:, k]])
            flags = self.active[kind, at][k] if groups else []
            rows += [
                (value, kind != "inequality")
                for group, value, flag in zip(groups, values, flags, strict=True)
                if flag and isinstance(group.policy, Hard)
            ]
        return rows
