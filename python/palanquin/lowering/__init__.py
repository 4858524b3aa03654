"""From a `Problem` to CasADi functions: values and derivatives of one knot, in the tangent space.

Every function takes whole knot vectors z (all blocks, ambient) and the parameter vector p. Sparsity
is fixed; which columns and rows count at a knot is decided at run time by roles and flags. Those of
running knots are compiled over SIMD lanes, see `lanes`.

| function | arguments | results |
|---|---|---|
| structure | p | role and chart flag per block; active flags of running and terminal row groups |
| chart | z, p | z with charted blocks embedded; d(block)/d(coordinates) |
| running | z, z+, p | d, cost, g, h |
| running_linear | z, z+, p | d, cost, g, h, dd/dz, dd/dx+, cost gradient, Hessian, dg/dz, dh/dz |
| terminal(_linear) | z, p | the same without dynamics |
| link(_linear) | z-, z, p | c, dc/dz-, dc/dz |
| nlp_* | see `nlp_functions` | ambient values, Jacobians and exact Hessians, for Ipopt |
| exact_* | see `exact_hessian_functions` | exact Hessians in the tangent space |
"""

from palanquin.lowering.dynamics import explicit_next_state, next_state, state_jacobians
from palanquin.lowering.exact import exact_hessian_functions
from palanquin.lowering.functions import sqp_functions, value_functions
from palanquin.lowering.knot import Knot, knot_symbols
from palanquin.lowering.manifest_lines import manifest, structure_lines
from palanquin.lowering.nlp import nlp_functions
from palanquin.lowering.stage import exact_tangent_hessian, groups_at, stacked_rows, total_cost

__all__ = [
    "Knot",
    "exact_hessian_functions",
    "exact_tangent_hessian",
    "explicit_next_state",
    "groups_at",
    "knot_symbols",
    "manifest",
    "next_state",
    "nlp_functions",
    "sqp_functions",
    "stacked_rows",
    "state_jacobians",
    "structure_lines",
    "total_cost",
    "value_functions",
]
