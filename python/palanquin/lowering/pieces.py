"""Long functions cut into pieces, so that compilers take a time linear in their length.

A lowered function is one straight line of assignments. Register allocation looks at all of it at
once, for a time that grows with its square; a piece of some hundred assignments is a function of
its own, which takes what pieces before it computed from memory.
"""

from __future__ import annotations

import re
from dataclasses import dataclass

PIECE = 500
"""Assignments of a piece."""

LONGEST = 1000
"""Assignments of a function that stays whole."""

LONGEST_OVER_LANES = 20_000
"""The same over SIMD lanes: those are evaluated at every knot of every step, a quarter slower in
pieces, and ten thousand assignments still compile in seconds.
"""

_FUNCTION = re.compile(
    r"static int (\w+)\((const casadi_real\*\* arg, casadi_real\*\* res), [^)]*\) \{\n"
    r"(?:  casadi_real a\d+[^;]*;\n)+"
    r"((?:  (?:a\d+|res\[\d+\]\[\d+\])=[^\n]*;\n)+)"
    r"  return 0;\n\}\n"
)


def in_pieces(code: str) -> str:
    """CasADi's C code with every long function in pieces."""

    def cut_function(function: re.Match[str]) -> str:
        name, parameters, body = function.groups()
        scope = Scope(name, "casadi_real", "a", parameters, "arg, res")
        pieces, calls = cut(body.splitlines(), scope, LONGEST)
        head = f"static int {name}({parameters}, casadi_int* iw, casadi_real* w, int mem) {{"
        return "\n".join([*pieces, head, *calls, "  return 0;", "}", ""])

    return _FUNCTION.sub(cut_function, code)


@dataclass(frozen=True)
class Scope:
    """What surrounds the assignments of a function.

    Attributes:
        name: of the function.
        kind: C type of its variables.
        prefix: of their names; a number follows.
        parameters: C declarations of what its pieces get.
        arguments: the same as they are passed.
    """

    name: str
    kind: str
    prefix: str
    parameters: str
    arguments: str

    def number(self, variable: str) -> int:
        """The number in a variable's name."""
        return int(variable.removeprefix(self.prefix))

    def shared(self, variable: str) -> str:
        """Where the value of a variable lies between pieces."""
        return f"shared[{self.number(variable)}]"

    def declaration(self, variables: set[str]) -> list[str]:
        """A line that declares variables, if there are any."""
        return [f"  {self.kind} {', '.join(sorted(variables))};"] if variables else []


def cut(lines: list[str], scope: Scope, longest: int) -> tuple[list[str], list[str]]:
    """Functions of the pieces, and the body that calls them; a short function keeps its body.

    Args:
        lines: "  VARIABLE = EXPRESSION;", or statements that assign no variable.
        scope: what is around them.
        longest: number of lines of a function that stays whole.
    """
    if len(lines) <= longest:
        return [], [*scope.declaration(_Piece(lines, scope).assigned), *lines]
    pieces = [_Piece(lines[i : i + PIECE], scope) for i in range(0, len(lines), PIECE)]
    used: set[str] = set()  # variables whose values later pieces take
    functions: list[str] = []
    calls: list[str] = []
    for number, piece in reversed(list(enumerate(pieces))):
        functions.append(piece.function(number, used & piece.assigned))
        calls.append(f"  {scope.name}_{number}({scope.arguments}, shared);")
        used = (used - piece.assigned) | piece.taken
    size = 1 + max(scope.number(v) for piece in pieces for v in piece.assigned)
    return functions[::-1], [f"  {scope.kind} shared[{size}];", *calls[::-1]]


class _Piece:
    """Neighbouring lines: the variables that they assign, and those that they take from before."""

    def __init__(self, lines: list[str], scope: Scope) -> None:
        self._scope = scope
        self._lines: list[str] = []
        self.assigned: set[str] = set()
        self.taken: set[str] = set()
        variable = re.compile(rf"\b{scope.prefix}\d+\b")

        def value_of(found: re.Match[str]) -> str:
            if found[0] in self.assigned:
                return found[0]
            self.taken.add(found[0])
            return scope.shared(found[0])

        for line in lines:
            target, sign, value = line.partition("=")
            self._lines.append(target + sign + variable.sub(value_of, value))
            if variable.fullmatch(target.strip()):
                self.assigned.add(target.strip())

    def function(self, number: int, given: set[str]) -> str:
        """The piece as a function that hands on the variables of `given`."""
        scope = self._scope
        head = (
            f"static __attribute__((noinline)) void {scope.name}_{number}("
            f"{scope.parameters}, {scope.kind}* restrict shared) {{"
        )
        give = [f"  {scope.shared(v)} = {v};" for v in sorted(given)]
        return "\n".join([head, *scope.declaration(self.assigned), *self._lines, *give, "}"])
