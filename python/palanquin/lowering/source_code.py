"""C code of lowered functions."""

from __future__ import annotations

import re
from pathlib import Path

import casadi as ca

from palanquin.lowering.lanes import PRELUDE, lane_code
from palanquin.lowering.pieces import in_pieces

INSTRUCTIONS = Path(__file__).with_name("instructions.h").read_text()

# Those that the engine evaluates at every knot of the horizon.
_OVER_LANES = ("running", "running_linear")


def source_code(functions: list[ca.Function], manifest: str) -> str:
    """C code that exports the functions, in CasADi's calling convention, and the manifest.

    Functions of running knots come over lanes as well where their operations allow it; see
    `lane_code`.
    """
    generator = ca.CodeGenerator("lowered.c", {"with_header": False})
    over_lanes = []
    for function in functions:
        code = lane_code(function) if function.name() in _OVER_LANES else None
        if code is None:
            generator.add(function)
        else:
            over_lanes.append(code)
    if over_lanes:
        over_lanes = [PRELUDE, *over_lanes, _LANE_COUNT]
    scalar = in_pieces(_without_null_checks(generator.dump()))
    return "\n".join([scalar, *over_lanes, _manifest_code(manifest), INSTRUCTIONS])


_LANE_COUNT = "CASADI_SYMBOL_EXPORT casadi_int palanquin_lanes(void) { return LANES; }\n"


def _without_null_checks(code: str) -> str:
    """CasADi asks before every access whether the argument or result is there. The engine always
    passes all of them, and without the questions a quarter of the machine code goes.
    """
    code = re.sub(r"if \(res\[\d+\]!=0\) ", "", code)
    return re.sub(r"arg\[\d+\]\? (arg\[\d+\]\[\d+\]) : 0", r"\1", code)


def _manifest_code(manifest: str) -> str:
    lines = "\n".join(f'  "{line}\\n"' for line in manifest.splitlines())
    return f"CASADI_SYMBOL_EXPORT const char* palanquin_manifest(void) {{\n  return\n{lines};\n}}\n"
