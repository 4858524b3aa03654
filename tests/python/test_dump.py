"""A solve travels as one file, to the last bit; files that are no dumps are refused in words."""

import contextlib
import io
import json
import os
import pickle
import subprocess
import sys
import zipfile

import numpy as np
import pytest
from support.mutations import RUNS, garbled, mutated
from typer.testing import CliRunner

import palanquin as pq
from palanquin.cli import app
from palanquin.dump import SUFFIX, is_dump


@pytest.fixture(autouse=True)
def cache(session_cache, monkeypatch):
    monkeypatch.setenv("PALANQUIN_CACHE", str(session_cache))


def unicycle(lowered, kind=pq.Sqp, **options):
    """A solver with a policy of its own, and a solve's arguments that are not the defaults."""
    solver = kind(lowered, horizon=8, **options)
    solver.set_policy("lane", pq.Penalty(stiffness=777.0, smoothing=0.002))
    parameters = lowered.parameters(8)
    parameters["dt"] = 0.07
    measured = lowered.knot()
    measured["pose"] = [0.1, -0.2, 0.3]
    guess = np.tile(measured.values, (9, 1))
    guess[3:] += 0.01
    return solver, parameters, measured, guess


def assert_same(plan, other):
    np.testing.assert_array_equal(plan.xs, other.xs)
    assert plan.status is other.status
    assert plan.message == other.message
    assert plan.iteration_count == other.iteration_count
    assert plan.violation == other.violation


# ---- the same solve ------------------------------------------------------------------------------

SOLVERS = {
    "structured": (pq.Sqp, {"qp": "structured", "line_search": {"armijo": 2e-4}}),
    "osqp": (pq.Sqp, {"qp": "osqp", "form": "paper", "max_iterations": 2}),
    "exact": (pq.Sqp, {"hessian": "exact", "damping": {"first": 0.3}}),
    "ipopt": (pq.Ipopt, {"penalize": True, "tolerance": 1e-5}),
}


@pytest.mark.parametrize("name", SOLVERS)
def test_a_dump_is_the_same_solve(lowered, tmp_path, name):
    kind, options = SOLVERS[name]
    solver, *arguments = unicycle(lowered("Unicycle"), kind, **options)
    plan = solver.solve(*arguments)
    dump = pq.read_dump(plan.dump(tmp_path / "a.palanquin"))
    assert dump.header.outcome["status"] == plan.status.name
    instance = dump.instance()
    assert instance.policies == solver.policies
    assert instance.policies["lane"] == pq.Penalty(777.0, 0.002)
    assert_same(plan, instance.solve())


def test_another_process_without_cache_or_compiler_gives_the_same_bits(lowered, tmp_path):
    solver, *arguments = unicycle(lowered("Unicycle"))
    plan = solver.solve(*arguments)
    file = plan.dump(tmp_path / "a.palanquin")
    program = (
        "import sys, palanquin as pq\n"
        "plan = pq.read_dump(sys.argv[1]).instance().solve()\n"
        "print(plan.status.name, plan.xs.tobytes().hex())"
    )
    env = os.environ | {"PALANQUIN_CACHE": str(tmp_path / "none"), "CC": "/no/compiler"}
    done = subprocess.run(
        [sys.executable, "-c", program, file], capture_output=True, text=True, check=True, env=env
    )
    assert done.stdout.split() == [plan.status.name, plan.xs.tobytes().hex()]


def test_a_later_solve_dumps_what_it_was_asked(lowered, tmp_path):
    """Whatever the caller and the solver do with their arrays and settings afterwards."""
    solver, parameters, measured, guess = unicycle(lowered("Unicycle"))
    solver.solve(parameters, lowered("Unicycle").knot())
    plan = solver.solve(parameters, measured, guess)
    parameters["dt"] = 0.5
    measured["pose"], guess[:] = 0, 1
    solver.settings.max_iterations = 1
    solver.set_policy("lane", pq.SquaredHinge(3.0))
    solver.solve(parameters, measured)
    assert_same(plan, pq.read_dump(plan.dump(tmp_path / "a.palanquin")).instance().solve())


def test_a_solve_is_dumped_without_solving(lowered, tmp_path):
    solver, *arguments = unicycle(lowered("Unicycle"))
    file = solver.dump(tmp_path / "a.palanquin", *arguments)
    assert pq.read_dump(file).header.outcome is None
    assert_same(solver.solve(*arguments), pq.read_dump(file).instance().solve())


def test_both_phases_of_a_step_are_repeated(lowered, tmp_path):
    solver, parameters, measured, guess = unicycle(lowered("Unicycle"), max_iterations=1)
    solver.prepare(parameters, measured, guess)
    moved = measured.copy()
    moved["pose"] += 0.02
    plan = solver.feedback(moved)
    instance = pq.read_dump(plan.dump(tmp_path / "a.palanquin")).instance()
    np.testing.assert_array_equal(instance.predicted, measured.values)
    assert_same(plan, instance.solve())


def test_pickled_plans_say_that_they_have_no_instance(lowered, tmp_path):
    solver, *arguments = unicycle(lowered("Unicycle"))
    plan = pickle.loads(pickle.dumps(solver.solve(*arguments)))
    with pytest.raises(pq.ProblemError, match="results alone"):
        plan.dump(tmp_path / "a.palanquin")


# ---- dumps of failures ---------------------------------------------------------------------------


def impossible():
    """Rows that contradict each other at the end."""
    problem = pq.Problem(horizon=3, dt=0.1, name="impossible")
    x, u = problem.state("x", 1), problem.input("u", 1)
    problem.dynamics(x, x + problem.dt * u)
    problem.residual("effort", u)
    problem.equality("one", x - 1, at="terminal")
    problem.equality("two", x - 2, at="terminal")
    return problem.lower()


def test_failures_are_dumped_where_asked_and_successes_not(lowered, tmp_path):
    folder = tmp_path / "dumps" / "new"
    solver, *arguments = unicycle(lowered("Unicycle"), dump_on_failure=folder)
    assert solver.solve(*arguments).is_usable
    assert not folder.exists()
    failing = impossible()
    solver = pq.Sqp(failing, dump_on_failure=folder)
    plans = [solver.solve(failing.parameters(), failing.knot()) for _ in range(12)]
    plan = plans[0]
    assert not plan.is_usable
    files = sorted(folder.iterdir())
    assert len(files) == 10
    assert files[0].name.startswith(f"impossible-{plan.status.name.lower()}-")
    assert_same(plan, pq.read_dump(files[0]).instance().solve())


def test_a_dump_that_cannot_be_written_disturbs_nobody(tmp_path, caplog):
    failing = impossible()
    (tmp_path / "file").write_text("")
    solver = pq.Sqp(failing, dump_on_failure=tmp_path / "file" / "below")
    assert not solver.solve(failing.parameters(), failing.knot()).is_usable
    assert "was not dumped" in caplog.text


def test_a_dump_appears_whole_or_not_at_all(lowered, tmp_path):
    solver, *arguments = unicycle(lowered("Unicycle"))
    plan = solver.solve(*arguments)
    with pytest.raises(OSError, match="none"):
        plan.dump(tmp_path / "none" / "a.palanquin")
    plan.dump(tmp_path / "a.palanquin")
    assert [p.name for p in tmp_path.iterdir()] == ["a.palanquin"]


# ---- the command line ----------------------------------------------------------------------------


def run(*arguments):
    return CliRunner().invoke(app, ["solve", *map(str, arguments)])


def test_the_command_solves_a_dump(lowered, tmp_path):
    solver, *arguments = unicycle(lowered("Unicycle"))
    plan = solver.solve(*arguments)
    file, out = plan.dump(tmp_path / "any.name"), tmp_path / "out.json"
    done = run(file, "--out", out)
    assert done.exit_code == 0, done.output
    figures = json.loads(out.read_text())
    assert figures["status"] == "converged"
    np.testing.assert_array_equal(figures["trajectory"]["pose"], plan.trajectory["pose"])
    assert run(file, "--iterations", 1, "--qp", "ldl", "--out", out).exit_code == 0
    assert json.loads(out.read_text())["iterations"] == 1
    done = run(file, "--solver", "ipopt", "--penalty", "--out", out)
    assert done.exit_code == 0, done.output
    assert json.loads(out.read_text())["cost"] == pytest.approx(plan.cost, rel=1e-4)
    assert run(file, "--solver", "ipopt", "--qp", "osqp").exit_code == 2


def test_the_command_says_of_a_failing_dump_what_fails(tmp_path):
    failing = impossible()
    file = (
        pq.Sqp(failing).solve(failing.parameters(), failing.knot()).dump(tmp_path / "a.palanquin")
    )
    done = run(file)
    assert done.exit_code == 1
    assert "not solved" in done.output
    assert "two (row 0, knot 3)" in done.output or "one (row 0, knot 3)" in done.output


def test_a_case_that_fails_is_dumped(tmp_path):
    file = tmp_path / "failed.palanquin"
    case = "tests/data/cases/stand.json"
    assert run(case, "--iterations", 1, "--dump-on-failure", file).exit_code == 1
    assert pq.read_dump(file).header.settings["max_iterations"] == 1
    done = run(file, "--iterations", 50)
    assert done.exit_code == 0, done.output
    file.unlink()
    assert run(case, "--dump-on-failure", file).exit_code == 0
    assert not file.exists()


# ---- files that are no dumps ---------------------------------------------------------------------


@pytest.fixture(scope="module")
def sound(lowered_once, tmp_path_factory):
    """Entries of a dump by name."""
    path = tmp_path_factory.mktemp("dump") / "sound.palanquin"
    solver, *arguments = unicycle(lowered_once("Unicycle"))
    with zipfile.ZipFile(solver.dump(path, *arguments)) as archive:
        return {name: archive.read(name) for name in archive.namelist()}


def archive(entries, compression=zipfile.ZIP_STORED):
    """The bytes of an archive."""
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w", compression) as out:
        for name, data in entries.items():
            out.writestr(name, data)
    return file.getvalue()


def with_header(entries, **changes):
    header = json.loads(entries["dump.json"]) | changes
    return entries | {"dump.json": json.dumps(header).encode()}


def without(entries, *names):
    return {name: data for name, data in entries.items() if name not in names}


BAD = {
    "empty": (lambda _: b"", "no archive"),
    "text": (lambda _: b"nonsense " * 40, "no archive"),
    "foreign": (lambda _: archive({"a.txt": b"hello"}), "without a dump.json"),
    "newer": (lambda e: archive(with_header(e, version=2)), "newer version"),
    "other format": (lambda e: archive(with_header(e, format="zebra")), "does not say"),
    "cut": (lambda e: archive(e)[:5000], "damaged"),
    "method": (lambda e: archive(with_header(e, method="magic")), "method"),
    "setting": (lambda e: archive(with_header(e, settings={"qqp": 1})), "no field 'qqp'"),
    "value": (lambda e: archive(with_header(e, settings={"max_iterations": "x"})), "is 'x'"),
    "rule": (lambda e: archive(with_header(e, settings={"max_iterations": 0})), "max_iterations"),
    "policy": (
        lambda e: archive(
            with_header(e, policies={"lane": {"word": "soft", "stiffness": 1.0, "smoothing": 1.0}})
        ),
        "policy is 'soft'",
    ),
    "guess missing": (lambda e: archive(without(e, "guess")), "guess is missing"),
    "code missing": (lambda e: archive(without(e, "problem/sqp.c")), "sqp.c is missing"),
    "half a number": (lambda e: archive(e | {"guess": e["guess"][:-3]}), "guess has"),
    "nan": (lambda e: archive(e | {"guess": b"\xff" * len(e["guess"])}), "not finite"),
    "json": (lambda e: archive(e | {"dump.json": b"{"}), "dump.json is damaged"),
}


@pytest.mark.parametrize("name", BAD)
def test_a_bad_file_is_refused_in_words(sound, tmp_path, name):
    make, words = BAD[name]
    path = tmp_path / "bad.palanquin"
    path.write_bytes(make(sound))
    with pytest.raises(pq.ProblemError, match=words) as error:
        pq.read_dump(path)
    assert str(path) in str(error.value)
    done = run(path)
    assert done.exit_code == 2
    assert is_dump(path)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda e: with_header(e, horizon=7), "parameters has .* numbers"),
        (lambda e: e | {"measured": e["measured"][:-8]}, "measured has"),
        (lambda e: e | {"problem/manifest": b"palanquin 2\nblok x\n"}, "line 2|manifest"),
        (lambda e: e | {"problem/manifest": b"palanquin 999\n"}, "manifest"),
    ],
)
def test_what_does_not_belong_together_is_refused(sound, tmp_path, change, words):
    path = tmp_path / "bad.palanquin"
    path.write_bytes(archive(change(sound)))
    with pytest.raises(pq.PalanquinError, match=words):
        pq.read_dump(path).instance()


def test_there_is_no_such_file(tmp_path):
    with pytest.raises(pq.ProblemError, match="No such file"):
        pq.read_dump(tmp_path / f"none{SUFFIX}")


def test_mutated_dumps_are_read_or_refused(sound, tmp_path):
    path = tmp_path / "mutated.palanquin"
    small = {n: d if n in ("dump.json", "guess") else d[:64] for n, d in sound.items()}
    for seed in range(RUNS):
        entries = small
        if seed % 3:
            header = mutated(json.loads(small["dump.json"]), seed)
            entries = small | {"dump.json": json.dumps(header).encode()}
        data = archive(entries, zipfile.ZIP_DEFLATED)
        path.write_bytes(garbled(data, seed) if seed % 3 == 0 else data)
        with contextlib.suppress(pq.PalanquinError):
            pq.read_dump(path)
