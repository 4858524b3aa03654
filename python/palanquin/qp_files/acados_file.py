"""QPs by stages as acados writes them: a JSON object of fields `NAME_STAGE`.

A, B, b are the dynamics; Q, R, S, q, r the cost 1/2 (u, x)'[R S; S' Q](u, x) + r'u + q'x; C, D, lg,
ug the rows lg <= Cx + Du <= ug; lbu, ubu, lbx, ubx bounds of those variables of (u, x) that idxb
names. What is empty may be missing.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np

from palanquin.errors import ProblemError
from palanquin.qp_files.general_qp import Array
from palanquin.qp_files.ocp_qp import Knot, OcpQp

_INFINITE = 1e8  # acados has no infinities in a QP: its own is 1e10, in masked rows


def read_acados(path: Path) -> OcpQp:
    """Raises ProblemError, naming field and stage, for what is no such file, and for slacks."""
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
    except (json.JSONDecodeError, UnicodeDecodeError) as error:
        raise ProblemError(f"{path}: not JSON: {error}") from error
    if not isinstance(content, dict):
        raise ProblemError(f"{path}: a QP is an object of fields, such as A_00")
    fields: dict[tuple[str, int], Any] = {}
    for key, value in content.items():
        name, _, stage = key.rpartition("_")
        if name and stage.isdigit():
            fields[name, int(stage)] = value
    last = max((stage for name, stage in fields if name in ("Q", "q", "R")), default=-1)
    if last < 0:
        raise ProblemError(f"{path}: there is no field Q or R of any stage")
    if any(name == "idxs" and np.size(value) for (name, _), value in fields.items()):
        raise ProblemError(f"{path}: slacked rows (idxs) are not read")
    reader = _Reader(path, fields)
    return OcpQp(path.stem, tuple(reader.knot(k, k == last) for k in range(last + 1)))


class _Reader:
    def __init__(self, path: Path, fields: dict[tuple[str, int], Any]) -> None:
        self._path, self._fields = path, fields

    def knot(self, k: int, is_last: bool) -> Knot:
        """Stage k."""
        nx, nu = (
            max(self._vector(v, k).size, self._side(m, k)) for v, m in (("q", "Q"), ("r", "R"))
        )
        low, up = self._vector("lg", k), self._vector("ug", k)
        general = np.hstack(
            [self._matrix("C", k, low.size, nx), self._matrix("D", k, low.size, nu)]
        )
        bounds, lower, upper = self._bounds(k, nx, nu)
        S = self._matrix("S", k, nu, nx)
        Q, R = self._matrix("Q", k, nx, nx), self._matrix("R", k, nu, nu)
        b = np.zeros(0) if is_last else self._vector("b", k)
        return Knot(
            nx, nu,
            np.block([[Q, S.T], [S, R]]) if nx and nu else (Q if nx else R),
            np.concatenate([self._sized("q", k, nx), self._sized("r", k, nu)]),
            np.vstack([general, bounds]),
            _without_infinities(np.concatenate([low, lower]), -1.0),
            _without_infinities(np.concatenate([up, upper]), 1.0),
            np.hstack([self._matrix("A", k, b.size, nx), self._matrix("B", k, b.size, nu)]),
            b,
        )  # fmt: skip

    def _bounds(self, k: int, nx: int, nu: int) -> tuple[Array, Array, Array]:
        """Rows over (x, u), and their bounds."""
        sides = [np.concatenate([self._vector(s + "u", k), self._vector(s + "x", k)])
                 for s in ("lb", "ub")]  # fmt: skip
        inputs = self._vector("lbu", k).size
        whole = [*range(inputs)] if inputs in (0, nu) else []
        states = sides[0].size - inputs
        whole += [nu + i for i in range(states)] if states in (0, nx) else []
        index = self._vector("idxb", k).astype(int).tolist() or whole
        if len(index) != sides[0].size or sides[0].size != sides[1].size:
            raise ProblemError(
                f"{self._path}: stage {k} has {sides[0].size} lower and {sides[1].size} upper "
                f"bounds, and idxb names {len(index)} variables"
            )
        if any(not 0 <= i < nu + nx for i in index):
            raise ProblemError(f"{self._path}: idxb of stage {k} is beyond its {nu + nx} variables")
        rows = np.zeros((len(index), nx + nu))
        for row, i in zip(rows, index, strict=True):
            row[nx + i if i < nu else i - nu] = 1.0
        return rows, sides[0], sides[1]

    def _side(self, name: str, k: int) -> int:
        found = np.shape(self._fields.get((name, k), []))
        return int(found[0]) if found and found[-1] else 0

    def _vector(self, name: str, k: int) -> Array:
        try:
            return np.asarray(self._fields.get((name, k), []), dtype=float).ravel()
        except (TypeError, ValueError) as error:
            raise ProblemError(
                f"{self._path}: {name} of stage {k} is no list of numbers"
            ) from error

    def _sized(self, name: str, k: int, size: int) -> Array:
        vector = self._vector(name, k)
        if vector.size not in (0, size):
            raise ProblemError(
                f"{self._path}: {name} of stage {k} has {vector.size} entries, but must have {size}"
            )
        return vector if vector.size else np.zeros(size)

    def _matrix(self, name: str, k: int, rows: int, columns: int) -> Array:
        flat = self._vector(name, k)
        if flat.size == 0:
            return np.zeros((rows, columns))
        shape = np.shape(self._fields[name, k])
        if flat.size != rows * columns or (len(shape) == 2 and shape != (rows, columns)):
            raise ProblemError(
                f"{self._path}: {name} of stage {k} is {shape}, but must be {(rows, columns)}"
            )
        return flat.reshape(rows, columns)


def write_acados(path: Path, qp: OcpQp) -> None:
    """Rows over one variable as bounds, the others as C, D, lg, ug."""
    digits = len(str(len(qp.knots)))
    content: dict[str, Any] = {}
    for k, knot in enumerate(qp.knots):
        for name, value in _fields_of(knot).items():
            if np.size(value):
                content[f"{name}_{k:0{digits}d}"] = np.asarray(value).tolist()
    path.write_text(json.dumps(content, indent=1, sort_keys=True), encoding="utf-8")


def _fields_of(knot: Knot) -> dict[str, Any]:
    x, u = slice(0, knot.nx), slice(knot.nx, knot.size)
    F, H, g = knot.F, knot.H, knot.g
    fields: dict[str, Any] = {
        "A": F[:, x], "B": F[:, u], "b": knot.b,
        "Q": H[x, x], "R": H[u, u], "S": H[u, x], "q": g[x], "r": g[u],
    }  # fmt: skip
    is_bound = np.count_nonzero(knot.C, axis=1) == 1
    bounds: list[tuple[int, float, float]] = []
    taken: set[int] = set()
    for i in np.flatnonzero(is_bound):
        column = int(np.argmax(np.abs(knot.C[i])))
        if column in taken:
            is_bound[i] = False  # a second bound of the same variable is a row
            continue
        taken.add(column)
        sides = sorted([knot.low[i] / knot.C[i, column], knot.up[i] / knot.C[i, column]])
        place = column - knot.nx if column >= knot.nx else knot.nu + column
        bounds.append((place, sides[0], sides[1]))
    bounds.sort()
    inputs = [bound for bound in bounds if bound[0] < knot.nu]
    states = bounds[len(inputs) :]
    fields |= {
        "idxb": [place for place, _, _ in bounds],
        "lbu": _finite([low for _, low, _ in inputs]), "ubu": _finite([up for *_, up in inputs]),
        "lbx": _finite([low for _, low, _ in states]), "ubx": _finite([up for *_, up in states]),
        "C": knot.C[~is_bound][:, x], "D": knot.C[~is_bound][:, u],
        "lg": _finite(knot.low[~is_bound]), "ug": _finite(knot.up[~is_bound]),
    }  # fmt: skip
    return fields


def _finite(values: Any) -> Array:
    return np.clip(np.asarray(values, dtype=float), -100 * _INFINITE, 100 * _INFINITE)


def _without_infinities(values: Array, sign: float) -> Array:
    return np.where(sign * values >= _INFINITE, sign * np.inf, values)
