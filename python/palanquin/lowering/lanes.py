"""C code that evaluates a function at several knots at once, one in each lane of a SIMD register.

Lowered functions are straight lines of scalar operations without branches, so the same line over
vectors serves as many knots as a register has lanes. `lanes.h` holds the arithmetic and the
transposition of knots into lanes and back.
"""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

import casadi as ca

from palanquin.lowering.pieces import LONGEST_OVER_LANES, Scope, cut

PRELUDE = Path(__file__).with_name("lanes.h").read_text()
WINDOW = 8  # entries that `read_rows` takes at a time

# What an operation of CasADi becomes; those that are not here have no lane code.
_OPERATIONS = {
    ca.OP_ASSIGN: "{0}",
    ca.OP_ADD: "{0} + {1}",
    ca.OP_SUB: "{0} - {1}",
    ca.OP_MUL: "{0} * {1}",
    ca.OP_DIV: "{0} / {1}",
    ca.OP_NEG: "-{0}",
    ca.OP_INV: "1.0 / {0}",
    ca.OP_SQ: "{0} * {0}",
    ca.OP_TWICE: "2.0 * {0}",
    ca.OP_CONSTPOW: "lane_pow({0}, {1})",
    ca.OP_LT: "truth({0} < {1})",
    ca.OP_LE: "truth({0} <= {1})",
    ca.OP_EQ: "truth({0} == {1})",
    ca.OP_NE: "truth({0} != {1})",
    ca.OP_NOT: "truth({0} == 0.0)",
    ca.OP_AND: "truth(is_true({0}) & is_true({1}))",
    ca.OP_OR: "truth(is_true({0}) | is_true({1}))",
    ca.OP_IF_ELSE_ZERO: "if_else_zero({0}, {1})",
} | {
    getattr(ca, f"OP_{name.upper()}"): f"lane_{name}({arguments})"
    for arguments, names in {
        "{0}": "sqrt fabs sign exp log log1p expm1 sin cos tan asin acos atan sinh cosh tanh "
        "asinh acosh atanh floor ceil erf",
        "{0}, {1}": "fmin fmax copysign pow fmod remainder atan2 hypot",
    }.items()
    for name in names.split()
}


def lane_code(function: ca.Function) -> str | None:
    """C code of `function` over lanes, or None where it uses an operation without lane code.

    It exports NAME_lanes(arg, take, context), which reads argument i of the knot in `lane` from
    arg[i * LANES + lane] and hands its results to `take` one after the other, so that they are used
    while they are in the cache; and, in CasADi's calling convention, NAME for a single knot.
    """
    body = _body(function)
    if body is None:
        return None
    return "\n".join([*_patterns(function), *body, *_single_knot(function)]) + "\n"


def _body(function: ca.Function) -> list[str] | None:
    code, used = _assignments(function)
    if code is None:
        return None
    name = f"{function.name()}_lanes"
    inputs = [i for i in range(function.n_in()) if used[i]]
    context = "take_result take, void* context"
    arrays = [*(f"x{i}" for i in inputs), "y"]
    scope = Scope(
        name, "lanes", "w",
        parameters=", ".join([*(f"lanes* restrict {a}" for a in arrays), context]),
        arguments=", ".join([*arrays, "take, context"]),
    )  # fmt: skip
    pieces, body = cut(code, scope, LONGEST_OVER_LANES)
    return [
        *pieces,
        f"CASADI_SYMBOL_EXPORT void {name}(const double* const* arg, {context}) {{",
        *(_read(function, i, used[i]) for i in inputs),
        f"  lanes y[{_largest_result(function)}];",
        *body,
        "}",
    ]


def _assignments(function: ca.Function) -> tuple[list[str] | None, list[set[int]]]:
    """A line of C for each operation, None where one has no lane code; entries that are read of
    each argument.
    """
    used: list[set[int]] = [set() for _ in range(function.n_in())]
    taken = 0  # results that are complete
    code = []
    for k in range(function.n_instructions()):
        operation = function.instruction_id(k)
        operands, result = function.instruction_input(k), function.instruction_output(k)
        if operation == ca.OP_OUTPUT:
            if result[0] < taken:
                return None, used  # results share their memory: they must come in order
            code += [_take(i) for i in range(taken, result[0])]
            taken = result[0]
            code.append(f"  y[{result[1]}] = w{operands[0]};")
            continue
        if operation == ca.OP_INPUT:
            used[operands[0]].add(operands[1])
            value = f"x{operands[0]}[{operands[1]}]"
        elif operation == ca.OP_CONST:
            value = f"constant({_literal(function.instruction_constant(k))})"
        elif operation in _OPERATIONS:
            value = _OPERATIONS[operation].format(*(f"w{i}" for i in operands))
        else:
            return None, used
        code.append(f"  w{result[0]} = {value};")
    code += [_take(i) for i in range(taken, function.n_out())]
    return code, used


def _take(result: int) -> str:
    return f"  take(context, {result}, (const double*)y);"


def _largest_result(function: ca.Function) -> int:
    return max(1, *(function.nnz_out(i) for i in range(function.n_out())))


def _literal(value: float) -> str:
    if value != value:
        return "NAN"
    return value.hex() if abs(value) < float("inf") else f"{'-' if value < 0 else ''}INFINITY"


def _read(function: ca.Function, argument: int, used: Iterable[int]) -> str:
    size = function.nnz_in(argument)
    starts = _windows(used, size)
    return (
        f"  static const int starts{argument}[] = {{{', '.join(map(str, starts))}}};\n"
        f"  lanes x{argument}[{size}];\n"
        f"  read_rows(arg + {argument} * LANES, {size}, starts{argument}, {len(starts)}, "
        f"x{argument});"
    )


def _windows(used: Iterable[int], size: int) -> list[int]:
    """Starts of windows within [0, size) that cover the entries in use."""
    starts: list[int] = []
    for entry in sorted(used):
        if not starts or entry >= starts[-1] + WINDOW:
            starts.append(max(0, min(entry, size - WINDOW)))
    return starts


def _patterns(function: ca.Function) -> list[str]:
    """What a loader asks for besides the code, under CasADi's names."""
    name = function.name()
    code = []
    for side, count, pattern in (
        ("in", function.n_in(), function.sparsity_in),
        ("out", function.n_out(), function.sparsity_out),
    ):
        for i in range(count):
            entries = ", ".join(map(str, pattern(i).compress()))
            code.append(f"static const casadi_int {name}_{side}{i}[] = {{{entries}}};")
        cases = " ".join(f"case {i}: return {name}_{side}{i};" for i in range(count))
        export = "CASADI_SYMBOL_EXPORT"
        code += [
            f"{export} casadi_int {name}_n_{side}(void) {{ return {count}; }}",
            f"{export} const casadi_int* {name}_sparsity_{side}(casadi_int i) {{",
            f"  switch (i) {{ {cases} default: return 0; }}",
            "}",
        ]
    return [
        *code,
        f"CASADI_SYMBOL_EXPORT int {name}_work("
        "casadi_int* arg, casadi_int* res, casadi_int* iw, casadi_int* w) {",
        f"  *arg = {function.n_in()}, *res = {function.n_out()}, *iw = 0, *w = 0;",
        "  return 0;",
        "}",
    ]


def _single_knot(function: ca.Function) -> list[str]:
    """The same knot in every lane, of which the first one's results are kept."""
    name, arguments = function.name(), function.n_in()
    sizes = ", ".join(str(function.nnz_out(i)) for i in range(function.n_out()))
    return [
        f"CASADI_SYMBOL_EXPORT int {name}("
        "const double** arg, double** res, casadi_int* iw, double* w, int mem) {",
        f"  static const int sizes[] = {{{sizes}}};",
        f"  const double* arguments[{arguments} * LANES];",
        f"  for (int i = 0; i < {arguments} * LANES; ++i) arguments[i] = arg[i / LANES];",
        "  struct first_lane first = {res, sizes};",
        f"  {name}_lanes(arguments, take_first_lane, &first);",
        "  return 0;",
        "}",
    ]
