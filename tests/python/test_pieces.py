"""Functions in pieces: the same values, and a compile time that does not explode."""

import ctypes
import re
import shutil
import subprocess

import casadi as ca
import numpy as np
import pytest

from palanquin.lowering import lanes, pieces, source_code

CC = shutil.which("cc")


def random_function(operations, seed=0):
    """A straight line of operations over values from near and far."""
    rng = np.random.default_rng(seed)
    x, p = ca.SX.sym("x", 5), ca.SX.sym("p", 2)
    values = [*ca.vertsplit(x), *ca.vertsplit(p)]
    for _ in range(operations):
        i, j = rng.integers(max(0, len(values) - rng.integers(1, 400)), len(values), 2)
        a, b = values[i], values[j]
        choices = [
            a + b,
            ca.sin(a) * b,
            a - 0.3 * b,
            ca.if_else(a < b, a, ca.cos(b)),
            ca.fmax(a, b),
        ]
        values.append(choices[rng.integers(len(choices))])
    picked = [values[i] for i in rng.integers(0, len(values), 40)]
    return ca.Function("f", [x, p], [ca.vertcat(*picked, values[-1]), values[-2]])


def compiled(code, folder):
    source = folder / "code.c"
    source.write_text(code)
    command = [
        CC,
        "-O1",
        "-shared",
        "-fPIC",
        "-w",
        str(source),
        "-o",
        str(folder / "code.so"),
        "-lm",
    ]
    subprocess.run(command, check=True)
    return ctypes.CDLL(str(folder / "code.so")).f


def evaluated(code, function, arguments):
    doubles = ctypes.POINTER(ctypes.c_double)
    inputs = [np.asarray(a, float) for a in arguments]
    outputs = [np.full(function.nnz_out(i), np.nan) for i in range(function.n_out())]
    pointers = [
        (doubles * len(v))(*(a.ctypes.data_as(doubles) for a in v)) for v in (inputs, outputs)
    ]
    assert code(*pointers, None, None, 0) == 0
    return outputs


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("over_lanes", [False, True])
def test_pieces_compute_what_the_whole_does(over_lanes, seed, tmp_path, monkeypatch):
    function = random_function(1500, seed)
    monkeypatch.setattr(pieces, "PIECE", 70)
    monkeypatch.setattr(pieces, "LONGEST", 100)
    monkeypatch.setattr(lanes, "LONGEST_OVER_LANES", 100)
    monkeypatch.setattr(source_code, "_OVER_LANES", ("f",) if over_lanes else ())
    code = source_code.source_code([function], "")
    assert len(re.findall(r"static __attribute__\(\(noinline\)\) void \w+_\d+\(", code)) > 10
    run = compiled(code, tmp_path)
    for arguments in np.random.default_rng(seed).uniform(-2, 2, (5, 7)):
        split = (arguments[:5], arguments[5:])
        for got, expected in zip(evaluated(run, function, split), function(*split), strict=True):
            np.testing.assert_allclose(got, expected.full().ravel(), rtol=1e-9, atol=1e-12)


def test_no_function_of_a_long_one_is_long():
    code = source_code.source_code([random_function(20_000)], "")
    bodies = re.findall(r"^static [^\n]*\{\n(.*?)^\}", code, re.DOTALL | re.MULTILINE)
    assert max(body.count("\n") for body in bodies) < 2 * pieces.PIECE
    assert sum(body.count("\n") for body in bodies) > 10_000


def test_short_functions_stay_whole():
    code = source_code.source_code([random_function(100)], "")
    assert "noinline" not in code
