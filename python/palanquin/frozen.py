"""A problem as it is when it is lowered: nothing deferred, nothing that a user may still change."""

from __future__ import annotations

import io
import pickle
from dataclasses import dataclass
from typing import Any

import casadi as ca

from palanquin.contents import Contents
from palanquin.problem import Problem
from palanquin.statements import checked_horizon, checked_name
from palanquin.terms import Expression


class FrozenProblem(Problem):
    """A copy of a problem's statements. What is added to the problem later is not in it.

    It pickles, by expressions that CasADi serializes.
    """

    def __init__(self, problem: Problem) -> None:
        self.horizon = checked_horizon(problem.horizon)
        self.name = checked_name("problem", problem.name)
        self._contents = problem._contents.frozen()
        self.dt = self._contents.parameters["dt"].symbol

    def identity(self) -> str:
        """What is stated but names, sizes and defaults, as text: equal for equal problems."""
        kinds = [(c.name, c.at, c.weight is None) for c in self.costs]
        increments = [self.dynamics_of(b).is_increment for b in self.blocks if b.is_state]
        return f"{kinds} {increments} {Packed.of(self._contents).expressions}"

    def __getstate__(self) -> dict[str, Any]:
        state = self.__dict__ | {"_contents": Packed.of(self._contents)}
        del state["dt"]
        return state

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__dict__.update(state)
        self._contents = state["_contents"].unpacked()
        self.dt = self._contents.parameters["dt"].symbol


@dataclass(frozen=True)
class Packed:
    """Frozen contents as bytes, without a link to live symbols.

    Attributes:
        records: the contents with numbers in the place of expressions.
        symbols: names of all symbols in the expressions.
        expressions: a serialized function from the symbols to the expressions.
    """

    records: bytes
    symbols: list[str]
    expressions: str

    @classmethod
    def of(cls, contents: Contents) -> Packed:
        """Packs frozen contents."""
        file = io.BytesIO()
        pickler = _Pickler(file)
        pickler.dump(contents)
        symbols = ca.symvar(ca.veccat(*pickler.expressions))
        function = ca.Function("statement", [ca.vertcat(*symbols)], pickler.expressions)
        return cls(file.getvalue(), [s.name() for s in symbols], function.serialize())

    def unpacked(self) -> Contents:
        """The contents over symbols of their own."""
        function = ca.Function.deserialize(self.expressions)
        expressions = function.call([ca.vertcat(*map(ca.SX.sym, self.symbols))])
        return _Unpickler(self.records, expressions).load()


class _Pickler(pickle.Pickler):
    def __init__(self, file: io.BytesIO) -> None:
        super().__init__(file)
        self.expressions: list[Expression] = []

    def persistent_id(self, obj: Any) -> int | None:
        """The number under which an expression is stored apart; None for anything else."""
        if not isinstance(obj, ca.SX):
            return None
        self.expressions.append(obj)
        return len(self.expressions) - 1


class _Unpickler(pickle.Unpickler):
    def __init__(self, records: bytes, expressions: list[Expression]) -> None:
        super().__init__(io.BytesIO(records))
        self._expressions = expressions

    def persistent_load(self, pid: Any) -> Expression:
        """The expression of a number."""
        return self._expressions[pid]
