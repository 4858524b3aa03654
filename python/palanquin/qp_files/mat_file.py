"""QPs in MATLAB's format: the Maros-Meszaros set as it is spread for QP solvers, and PIQP's own."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from palanquin.errors import ProblemError
from palanquin.qp_files.general_qp import Array, GeneralQp

_INFINITE = 1e20  # what such files write for no bound
_MOST = 5000  # variables and rows of what is made dense
_PIQP = {"P", "c", "A", "b", "G", "h_l", "h_u", "x_l", "x_u"}


def read_mat(path: Path) -> GeneralQp:
    """A QP of P, q, A, l and u, or of PIQP's P, c, A, b, G, h_l, h_u, x_l and x_u.

    Raises ProblemError without SciPy, for what is none of these, and for QPs too large to be dense.
    """
    try:
        from scipy.io import loadmat
        from scipy.io.matlab import MatReadError
    except ImportError as error:
        raise ProblemError(f"{path}: reading MATLAB's files needs SciPy") from error
    try:
        content = loadmat(str(path))
        _refuse_large(path, content)
        P, q, C, low, up = _piqp(content) if content.keys() >= _PIQP else _maros_meszaros(content)
    except (MatReadError, ValueError, KeyError, NotImplementedError) as error:
        raise ProblemError(f"{path}: not a QP with P, q, A, l and u: {error}") from error
    low, up = np.where(low <= -_INFINITE, -np.inf, low), np.where(up >= _INFINITE, np.inf, up)
    bound = np.isfinite(low) | np.isfinite(up)
    return GeneralQp(path.stem, _whole(P), q, C[bound], low[bound], up[bound])


def _refuse_large(path: Path, content: Mapping[str, Any]) -> None:
    rows, columns = np.shape(content["A"])
    if max(rows, columns) > _MOST:
        raise ProblemError(f"{path}: {columns} variables and {rows} rows are too many")


def _maros_meszaros(content: Mapping[str, Any]) -> tuple[Array, ...]:
    P, A = _dense(content["P"]), _dense(content["A"])
    return P, _vector(content["q"]), A, _vector(content["l"]), _vector(content["u"])


def _piqp(content: Mapping[str, Any]) -> tuple[Array, ...]:
    """Equalities A x = b, rows h_l <= G x <= h_u, bounds x_l <= x <= x_u, all as rows."""
    P, b = _dense(content["P"]), _vector(content["b"])
    C = np.vstack([_dense(content["A"]), _dense(content["G"]), np.eye(P.shape[0])])
    low = np.concatenate([b, _vector(content["h_l"]), _vector(content["x_l"])])
    up = np.concatenate([b, _vector(content["h_u"]), _vector(content["x_u"])])
    return P, _vector(content["c"]), C, low, up


def _whole(P: Array) -> Array:
    """Some files hold one triangle."""
    if not np.any(np.triu(P, 1)) or not np.any(np.tril(P, -1)):
        P = P + P.T - np.diag(np.diag(P))
    return 0.5 * (P + P.T)


def _dense(matrix: Any) -> Array:
    return np.asarray(matrix.toarray() if hasattr(matrix, "toarray") else matrix, dtype=float)


def _vector(values: Any) -> Array:
    return np.asarray(values, dtype=float).ravel()
