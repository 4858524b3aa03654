"""The Maros-Meszaros set in MATLAB's format, as it is spread for QP solvers."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from palanquin.errors import ProblemError
from palanquin.qp_files.general_qp import GeneralQp

_INFINITE = 1e20  # what such files write for no bound
_MOST = 5000  # variables and rows of what is made dense


def read_mat(path: Path) -> GeneralQp:
    """Raises ProblemError without SciPy, and for QPs too large to be dense."""
    try:
        from scipy.io import loadmat
        from scipy.io.matlab import MatReadError
    except ImportError as error:
        raise ProblemError(f"{path}: reading MATLAB's files needs SciPy") from error
    try:
        content = loadmat(str(path))
        P, q, A, low, up = (content[name] for name in ("P", "q", "A", "l", "u"))
    except (MatReadError, ValueError, KeyError, NotImplementedError) as error:
        raise ProblemError(f"{path}: not a QP with P, q, A, l and u: {error}") from error
    if max(A.shape) > _MOST:
        raise ProblemError(f"{path}: {A.shape[1]} variables and {A.shape[0]} rows are too many")
    P, A = (np.asarray(m.toarray() if hasattr(m, "toarray") else m, float) for m in (P, A))
    low, up = (np.asarray(v, dtype=float).ravel() for v in (low, up))
    low, up = np.where(low <= -_INFINITE, -np.inf, low), np.where(up >= _INFINITE, np.inf, up)
    # Some files hold one triangle.
    P = (
        P + P.T - np.diag(np.diag(P))
        if not np.any(np.triu(P, 1)) or not np.any(np.tril(P, -1))
        else P
    )
    return GeneralQp(path.stem, 0.5 * (P + P.T), np.ravel(q).astype(float), A, low, up)
