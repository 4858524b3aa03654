"""The .npz files of the public benchmarks for QP solvers."""

from __future__ import annotations

import io
import pickle
import zipfile
from pathlib import Path
from typing import Any

import numpy as np

from palanquin.errors import ProblemError
from palanquin.qp_files.general_qp import Array, GeneralQp
from palanquin.qp_files.ocp_qp import OcpQp
from palanquin.qp_files.stages import from_general

_MATRICES = ("P", "q", "G", "h", "A", "b", "lb", "ub")
_SAFE = {
    ("numpy", "ndarray"), ("numpy", "dtype"),
    ("numpy.core.multiarray", "_reconstruct"), ("numpy._core.multiarray", "_reconstruct"),
    ("numpy.core.multiarray", "scalar"), ("numpy._core.multiarray", "scalar"),
    ("numpy.core.numeric", "_frombuffer"), ("numpy._core.numeric", "_frombuffer"),
}  # fmt: skip


class _Unpickler(pickle.Unpickler):
    """Takes arrays and SciPy's sparse matrices: pickles of other things may run what they like."""

    def find_class(self, module: str, name: str) -> Any:
        is_sparse = module.startswith("scipy.sparse") and name.endswith(("_matrix", "_array"))
        if is_sparse or (module, name) in _SAFE:
            return super().find_class(module, name)
        raise pickle.UnpicklingError(f"{module}.{name} is no part of a matrix")


def read_npz(path: Path) -> GeneralQp | OcpQp:
    """By stages if the file has `stages` [knots, 2], else general."""
    arrays = _arrays(path)
    missing = [key for key in ("P", "q") if arrays.get(key) is None]
    if missing:
        raise ProblemError(f"{path}: there is no {' and no '.join(missing)}")
    q = np.asarray(arrays["q"], dtype=float).ravel()
    n = q.size
    C, low, up = [], [], []

    def add(matrix: Any, lower: Any, upper: Any) -> None:
        rows = np.eye(n) if matrix is None else _dense(matrix).reshape(-1, n)
        size = rows.shape[0]
        C.append(rows)
        low.append(np.full(size, -np.inf) if lower is None else np.ravel(lower).astype(float))
        up.append(np.full(size, np.inf) if upper is None else np.ravel(upper).astype(float))
        if not low[-1].size == up[-1].size == size:
            raise ProblemError(f"{path}: {size} rows have {low[-1].size} and {up[-1].size} bounds")

    if arrays.get("A") is not None:
        add(arrays["A"], arrays.get("b"), arrays.get("b"))
    if arrays.get("G") is not None:
        add(arrays["G"], arrays.get("low"), arrays.get("h"))
    lb, ub = arrays.get("lb"), arrays.get("ub")
    if lb is not None or ub is not None:
        add(None, lb, ub)
    P = _dense(arrays["P"])
    qp = GeneralQp(
        path.stem, 0.5 * (P + P.T), q, np.vstack(C) if C else np.zeros((0, n)),
        np.concatenate(low) if low else np.zeros(0), np.concatenate(up) if up else np.zeros(0),
    )  # fmt: skip
    qp, stages = _without_idle_rows(qp), arrays.get("stages")
    return qp if stages is None else from_general(qp, np.asarray(stages).tolist())


def _without_idle_rows(qp: GeneralQp) -> GeneralQp:
    bound = np.isfinite(qp.low) | np.isfinite(qp.up)
    return GeneralQp(qp.name, qp.P, qp.q, qp.C[bound], qp.low[bound], qp.up[bound])


def write_npz(path: Path, qp: GeneralQp | OcpQp) -> None:
    """Equalities as A and b, every other bound as a row of G; an OcpQp with its `stages`."""
    general = qp.general() if isinstance(qp, OcpQp) else qp
    equal = general.is_equality
    upper = ~equal & np.isfinite(general.up)
    lower = ~equal & np.isfinite(general.low)
    arrays: dict[str, Array] = {
        "P": general.P,
        "q": general.q,
        "G": np.vstack([general.C[upper], -general.C[lower]]),
        "h": np.concatenate([general.up[upper], -general.low[lower]]),
        "A": general.C[equal],
        "b": general.low[equal],
        "lb": np.full(general.q.size, -np.inf),
        "ub": np.full(general.q.size, np.inf),
    }
    if isinstance(qp, OcpQp):
        arrays["stages"] = np.array([[knot.nx, knot.nu] for knot in qp.knots])
    np.savez_compressed(path, **arrays)  # type: ignore[arg-type]


def _arrays(path: Path) -> dict[str, Any]:
    try:
        with zipfile.ZipFile(path) as archive:
            members = [name for name in archive.namelist() if name.endswith(".npy")]
            return {name[:-4]: _array(archive.read(name)) for name in members}
    except (zipfile.BadZipFile, pickle.UnpicklingError, ValueError, EOFError) as error:
        raise ProblemError(f"{path}: not a QP: {error}") from error
    except ImportError as error:
        raise ProblemError(f"{path} has sparse matrices; reading them needs SciPy") from error


def _array(content: bytes) -> Any:
    stream = io.BytesIO(content)
    version = np.lib.format.read_magic(stream)
    read = (
        np.lib.format.read_array_header_1_0
        if version == (1, 0)
        else np.lib.format.read_array_header_2_0
    )
    dtype = read(stream)[2]
    if not dtype.hasobject:
        return np.load(io.BytesIO(content), allow_pickle=False)
    value = _Unpickler(stream).load()
    is_wrapped = isinstance(value, np.ndarray) and value.dtype.hasobject and value.size == 1
    return value.reshape(-1)[0] if is_wrapped else value


def _dense(matrix: Any) -> Array:
    whole = matrix.toarray() if hasattr(matrix, "toarray") else matrix
    return np.atleast_2d(np.asarray(whole, dtype=float))
