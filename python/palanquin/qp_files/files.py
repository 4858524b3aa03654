"""Reading and writing by the ending of a file's name."""

from __future__ import annotations

import os
from pathlib import Path

from palanquin.errors import ProblemError
from palanquin.qp_files.acados_file import read_acados, write_acados
from palanquin.qp_files.general_qp import GeneralQp
from palanquin.qp_files.mat_file import read_mat
from palanquin.qp_files.npz_file import read_npz, write_npz
from palanquin.qp_files.ocp_qp import OcpQp

_READERS = {".npz": read_npz, ".json": read_acados, ".mat": read_mat}
FORMATS = tuple(_READERS)
"""Endings that `read_qp` knows."""


def read_qp(path: str | os.PathLike[str]) -> GeneralQp | OcpQp:
    """A QP from a file; by stages where the file says so.

    Raises:
        ProblemError: the ending is unknown, or the content is no QP.
        OSError: it cannot be read.
    """
    file = Path(path)
    if file.suffix not in _READERS:
        raise ProblemError(f"{file}: its name must end in {', '.join(FORMATS)}")
    return _READERS[file.suffix](file)


def write_qp(path: str | os.PathLike[str], qp: GeneralQp | OcpQp) -> Path:
    """Writes .npz, or .json for acados (a QP by stages only); returns the path.

    Raises:
        ProblemError: the ending is another one, or the QP has no stages.
        OSError: it cannot be written.
    """
    file = Path(path)
    if file.suffix == ".npz":
        write_npz(file, qp)
    elif file.suffix == ".json" and isinstance(qp, OcpQp):
        write_acados(file, qp)
    elif file.suffix == ".json":
        raise ProblemError(f"{file}: acados takes QPs by stages, and '{qp.name}' has none")
    else:
        raise ProblemError(f"{file}: its name must end in .npz or .json")
    return file
