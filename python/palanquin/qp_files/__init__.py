"""Quadratic programs as files that other solvers and their benchmarks read and write.

`read_qp` takes a QP from a file:

- `.npz`: arrays P, q, G, h, A, b, lb, ub of min x'Px/2 + q'x, Gx <= h, Ax = b, lb <= x <= ub, dense
  or SciPy's sparse ones, as the public benchmarks for QP solvers keep them. `stages`, if there,
  says how x is cut into knots;
- `.mat`: P, q, A, l, u of l <= Ax <= u (and r), as the Maros-Meszaros set is spread in MATLAB's
  format; needs SciPy;
- `.json`: what acados' `dump_last_qp_to_json` writes: a QP by stages.

`write_qp` writes `.npz` and `.json`.
"""

from palanquin.qp_files.files import FORMATS, read_qp, write_qp
from palanquin.qp_files.general_qp import GeneralQp, KktError
from palanquin.qp_files.ocp_qp import Knot, OcpQp
from palanquin.qp_files.stages import find_stages, from_general

__all__ = [
    "FORMATS",
    "GeneralQp",
    "KktError",
    "Knot",
    "OcpQp",
    "find_stages",
    "from_general",
    "read_qp",
    "write_qp",
]
