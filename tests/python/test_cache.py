"""Lowering's cache: keyed by content, and safe when things go wrong."""

import logging
import os
import re
import shutil
import signal
import stat
import subprocess
import sys
import time
from pathlib import Path

import filelock
import numpy as np
import pytest

import palanquin as pq
import palanquin.compiler
from palanquin import compilation

CC = shutil.which("cc")


def decay(rate=0.5, *, mass=1.0, weight=1.0, stiffness=420.0, scale=1.0, limit="limit"):
    """x+ = x + dt (u - rate x) / m: as small as a problem gets."""
    problem = pq.Problem(horizon=3, dt=0.1, name="decay")
    x, u = problem.state("x", 1), problem.input("u", 1)
    m = problem.parameter("mass", default=mass)
    problem.dynamics(x, increment=problem.dt * (u - rate * x) / m)
    problem.residual("effort", u, weight=problem.parameter("weight", default=weight))
    problem.residual("goal", x - 1, at="all")
    policy = pq.Penalty(stiffness=stiffness)
    problem.inequality(limit, u - 5, policy=policy, scale=scale)
    return problem


def is_usable(lowered):
    parameters, measured = lowered.parameters(), lowered.knot()
    return pq.Sqp(lowered, qp="ldl").solve(parameters, measured).status is pq.Status.CONVERGED


@pytest.fixture
def cache(tmp_path, monkeypatch):
    folder = tmp_path / "cache"
    monkeypatch.setenv("PALANQUIN_CACHE", str(folder))
    return folder


@pytest.fixture
def compiler(tmp_path, monkeypatch):
    """Makes $CC a shell script; `$CC_LOG` counts its compiles."""
    log = tmp_path / "compiles"
    path = tmp_path / "fake-cc"

    def set_script(body: str) -> None:
        # Questions about version and target are not compiles.
        path.write_text(
            f'#!/bin/sh\ncase "$*" in *--version*|*--help*) exec {CC} "$@";; esac\n'
            f'echo compile >> {log}\nfor last; do case "$last" in *.so) out="$last";; esac; done\n'
            f"{body}\n"
        )
        path.chmod(path.stat().st_mode | stat.S_IXUSR)
        monkeypatch.setenv("CC", str(path))

    set_script.compiles = lambda: len(log.read_text().split()) if log.exists() else 0
    set_script(f'exec {CC} "$@"')
    return set_script


def leftovers(folder):
    """What lies in a cache folder besides the lock."""
    return sorted(p.name for p in folder.iterdir() if p.name != ".lock")


# ---- the key -------------------------------------------------------------------------------------


def test_miss_then_hit(cache, compiler):
    first = decay().lower()
    assert not first.report.cache_hit
    assert first.report.compile_seconds > 0
    assert first.report.path.parent == cache
    second = decay().lower()
    assert second.report.cache_hit
    assert second.report.compile_seconds == 0
    assert second.report.path == first.report.path
    assert compiler.compiles() == 1
    assert is_usable(second)


def test_reports_hit_and_miss(cache, caplog):
    with caplog.at_level(logging.INFO, logger="palanquin.lowering"):
        decay().lower()
        assert "'decay': compiled in" in caplog.text
        decay().lower()
    assert "'decay': found in the cache" in caplog.text


@pytest.mark.parametrize("change", [{"mass": 3.0}, {"weight": 9.0}, {"stiffness": 7.0}])
def test_defaults_are_not_part_of_the_key(cache, change):
    path = decay().lower().report.path
    changed = decay(**change).lower()
    assert changed.report.cache_hit
    assert changed.report.path == path
    # The library is shared, the defaults are not.
    assert changed.parameters()["mass"][0] == change.get("mass", 1.0)
    assert changed.policies["limit"].stiffness == change.get("stiffness", 420.0)


@pytest.mark.parametrize("change", [{"rate": 0.6}, {"scale": 10.0}, {"limit": "bound"}])
def test_what_is_compiled_is_part_of_the_key(cache, change):
    path = decay().lower().report.path
    changed = decay(**change).lower()
    assert not changed.report.cache_hit
    assert changed.report.path != path


def test_flags_are_part_of_the_key(cache, monkeypatch):
    path = decay().lower().report.path
    monkeypatch.setattr(compilation, "DEFAULT_FLAGS", ("-O1", *compilation.DEFAULT_FLAGS[1:]))
    assert decay().lower().report.path != path


def test_the_compiler_is_part_of_the_key(cache, compiler):
    path = decay().lower().report.path
    compiler(f'exec {CC} "$@"  # another one')
    assert decay().lower().report.cache_hit
    script = f'case "$*" in *--version*) echo other 9.9; exit;; esac\nexec {CC} "$@"'
    (cache.parent / "fake-cc").write_text(f"#!/bin/sh\n{script}\n")
    assert decay().lower().report.path != path


def test_content_key_does_not_confuse_borders():
    assert compilation.content_key("ab", "c") != compilation.content_key("a", "bc")
    assert compilation.content_key("ab") == compilation.content_key(b"ab")


def test_further_libraries_are_cached_too(cache, compiler):
    lowered = decay().lower()
    path = lowered.library("nlp")
    assert lowered.library("nlp") == path
    assert decay().lower().library("nlp") == path
    assert compiler.compiles() == 2


# ---- compilers that fail -------------------------------------------------------------------------


@pytest.mark.parametrize(
    "body",
    ["kill -9 $$", 'head -c 100 /dev/zero > "$out"; kill -9 $$', "echo nonsense >&2; exit 1"],
    ids=["killed", "killed half-way", "failing"],
)
def test_failed_compile_leaves_nothing(cache, compiler, body):
    compiler(body)
    with pytest.raises(pq.LoweringError, match=r"failed on the code of 'decay-") as error:
        decay().lower()
    assert "nonsense" in str(error.value) or "exit status -9" in str(error.value)
    assert leftovers(cache) == []
    compiler(f'exec {CC} "$@"')
    assert is_usable(decay().lower())


def test_compiler_that_lies_is_found_out(cache, compiler):
    compiler('head -c 100 /dev/zero > "$out"')
    with pytest.raises(pq.LoweringError, match="cannot be loaded"):
        decay().lower()
    compiler(f'exec {CC} "$@"')
    assert is_usable(decay().lower())


def test_no_compiler(cache, monkeypatch, tmp_path):
    monkeypatch.setenv("PATH", str(tmp_path))
    monkeypatch.delenv("CC", raising=False)
    with pytest.raises(pq.LoweringError, match=r"no C compiler.*cc, gcc, clang.*apt install gcc"):
        decay().lower()


NOT_COMPILED_HERE = """
import sys
sys.path.insert(0, sys.argv[1])
import palanquin as pq
from test_cache import decay, is_usable
lowered = decay().lower()
assert lowered.report.cache_hit
assert is_usable(lowered)
assert pq.Ipopt(lowered, penalize=True).solve(lowered.parameters(), lowered.knot()).is_usable
"""


@pytest.mark.parametrize("changed", [{"PATH": "/nowhere"}, {"CC": "no-such-compiler"}])
def test_a_full_cache_needs_no_compiler(cache, changed):
    decay().lower().library("nlp")
    command = [sys.executable, "-c", NOT_COMPILED_HERE, os.path.dirname(__file__)]
    subprocess.run(command, check=True, env=os.environ | changed)


def test_the_processor_is_part_of_the_key(cache, monkeypatch):
    path = decay().lower().report.path
    monkeypatch.setattr(compilation, "processor_identity", lambda: "another processor")
    changed = decay().lower()
    assert not changed.report.cache_hit
    assert changed.report.path != path


def test_a_library_for_another_processor_is_not_run(cache, monkeypatch):
    flags = (*compilation.DEFAULT_FLAGS, "-D__builtin_cpu_supports(name)=0", "-mavx2")
    monkeypatch.setattr(compilation, "DEFAULT_FLAGS", flags)
    with pytest.raises(pq.LoweringError, match=r"compiled for processors with .*, which this one"):
        decay().lower()


def test_missing_cc(cache, monkeypatch):
    monkeypatch.setenv("CC", "no-such-compiler -x")
    with pytest.raises(pq.LoweringError, match="no-such-compiler"):
        decay().lower()


# ---- damage and company --------------------------------------------------------------------------


def test_truncated_library_is_rebuilt(cache, compiler):
    path = decay().lower().report.path
    os.truncate(path, path.stat().st_size // 2)
    again = decay().lower()
    assert not again.report.cache_hit
    assert compiler.compiles() == 2
    assert is_usable(again)


def test_damaged_library_is_rebuilt(cache, compiler):
    path = decay().lower().report.path
    size = path.stat().st_size
    path.unlink()  # this process has it mapped
    path.write_bytes(bytes(size))
    again = decay().lower()
    assert compiler.compiles() == 2
    assert is_usable(again)


def test_library_without_its_stamp_is_rebuilt(cache, compiler):
    path = decay().lower().report.path
    path.with_suffix(".size").unlink()
    assert not decay().lower().report.cache_hit
    assert compiler.compiles() == 2


# A shell's background jobs ignore interrupts, and so would their children.
PROGRAM = """
import signal, sys
signal.signal(signal.SIGINT, signal.default_int_handler)
sys.path.insert(0, sys.argv[1])
from test_cache import decay, is_usable
lowered = decay().lower()
assert is_usable(lowered)
print(lowered.report.cache_hit)
"""


@pytest.fixture
def lock(cache, compiler):
    """The lock of `decay()`'s library, which another process might hold."""
    path = decay().lower().report.path
    for file in cache.glob("decay-*"):
        file.unlink()
    return filelock.FileLock(cache / ".lock" / path.name)


def test_waiting_for_another_process_ends(cache, lock, compiler, monkeypatch):
    monkeypatch.setattr(compilation, "LOCK_TIMEOUT_S", 0.1)
    with lock, pytest.raises(pq.LoweringError, match=r"0\.1 s for another process.*lock"):
        decay().lower()
    assert compiler.compiles() == 1  # the fixture's


def test_waiting_is_told_with_the_name_of_whom(cache, lock, monkeypatch, caplog):
    monkeypatch.setattr(compilation, "PROGRESS_S", 0.1)
    monkeypatch.setattr(compilation, "LOCK_TIMEOUT_S", 0.4)
    note = cache / f".build-{Path(lock.lock_file).name}-x" / "owner"
    note.parent.mkdir()
    note.write_text("process 42 on elsewhere")
    caplog.set_level(logging.INFO, logger="palanquin.lowering")
    with lock, pytest.raises(pq.LoweringError, match="process 42 on elsewhere"):
        decay().lower()
    assert "waiting for process 42 on elsewhere" in caplog.text


def test_nobody_waits_for_the_compile_of_another_problem(cache, lock, monkeypatch):
    monkeypatch.setattr(compilation, "LOCK_TIMEOUT_S", 0.1)
    with lock:
        assert is_usable(decay(rate=0.6).lower())


def test_a_lock_that_cannot_be_had_is_told(cache, lock, monkeypatch, caplog):
    def refuse_lock(*_arguments, **_options):
        raise PermissionError(13, "Permission denied", lock.lock_file)

    monkeypatch.setattr(compilation.filelock, "FileLock", refuse_lock)
    lowered = decay().lower()
    assert "cannot be written" in caplog.text
    assert "Permission denied" in caplog.text
    assert cache not in lowered.report.path.parents
    assert is_usable(lowered)


@pytest.mark.skipif(os.geteuid() != 0, reason="needs two users")
def test_others_may_take_the_locks_of_a_shared_folder(cache):
    cache.mkdir()
    cache.chmod(0o777)
    decay().lower()
    (lock,) = (cache / ".lock").iterdir()
    assert lock.stat().st_mode & 0o777 == 0o666
    assert (cache / ".lock").stat().st_mode & 0o777 == 0o777


def start_process():
    folder = os.path.dirname(__file__)
    command = [sys.executable, "-c", PROGRAM, folder]
    return subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


def test_two_processes_at_once_compile_once(cache, compiler):
    compiler(f'sleep 1; exec {CC} "$@"')
    processes = [start_process() for _ in range(2)]
    answers = [p.communicate(timeout=120) for p in processes]
    assert all(p.returncode == 0 for p in processes), answers
    assert compiler.compiles() == 1
    assert sorted(out.strip() for out, _ in answers) == ["False", "True"]


def test_long_compiles_are_told(cache, compiler, monkeypatch, caplog):
    monkeypatch.setattr(palanquin.compiler, "PROGRESS_S", 0.1)
    compiler(f'sleep 0.5; exec {CC} "$@"')
    with caplog.at_level(logging.INFO, logger="palanquin.lowering"):
        decay().lower()
    assert "not in the cache, compiling 0.0 MB of C ..." in caplog.text
    assert re.search(r"lowering 'decay-\w+-\w+': compiling for \d+ s \.\.\.", caplog.text)


def test_an_interrupt_ends_the_compiler(cache, compiler, tmp_path):
    # It tells of itself only when its parent has long been waiting for it.
    compiler(f"sleep 0.5; echo $$ > {tmp_path}/pid; exec sleep 60")
    process = start_process()
    wait_until(lambda: (tmp_path / "pid").exists() and (tmp_path / "pid").read_text())
    process.send_signal(signal.SIGINT)
    _, errors = process.communicate(timeout=30)
    assert "KeyboardInterrupt" in errors
    wait_until(lambda: not Path(f"/proc/{(tmp_path / 'pid').read_text().strip()}").exists())
    assert [name for name in leftovers(cache) if name.startswith(".build-")] == []


def wait_until(is_so):
    deadline = time.monotonic() + 60
    while not is_so():
        assert time.monotonic() < deadline
        time.sleep(0.02)


def test_killed_process_leaves_no_lock_and_its_rubbish_is_swept(cache, compiler):
    compiler("exec sleep 5")
    process = start_process()
    deadline = time.monotonic() + 60
    while compiler.compiles() == 0 and time.monotonic() < deadline:
        time.sleep(0.05)
    process.kill()
    process.communicate()
    assert any(name.startswith(".build-") for name in leftovers(cache))
    compiler(f'exec {CC} "$@"')
    assert is_usable(decay().lower())
    assert not any(name.startswith(".build-") for name in leftovers(cache))


# ---- folders that do not take files --------------------------------------------------------------


def test_unwritable_folder_falls_back_with_a_warning(tmp_path, monkeypatch, caplog):
    (tmp_path / "file").write_text("in the way")
    monkeypatch.setenv("PALANQUIN_CACHE", str(tmp_path / "file" / "cache"))
    with caplog.at_level(logging.WARNING, logger="palanquin.lowering"):
        lowered = decay().lower()
    assert "cannot be written" in caplog.text
    assert "PALANQUIN_CACHE" in caplog.text
    assert is_usable(lowered)
    assert pq.Ipopt(lowered, penalize=True).solve(lowered.parameters(), lowered.knot()).is_usable


def test_read_only_folder_still_serves_what_it_holds(cache, monkeypatch):
    decay().lower()
    monkeypatch.setattr(compilation.tempfile, "NamedTemporaryFile", refuse("Read-only file system"))
    assert decay().lower().report.cache_hit


def refuse(reason):
    def raise_error(*_args, **_options):
        raise OSError(30, reason)

    return raise_error


@pytest.mark.parametrize("reason", ["Read-only file system", "No space left on device"])
def test_folder_that_takes_no_file_falls_back(cache, monkeypatch, caplog, reason):
    monkeypatch.setattr(compilation.tempfile, "NamedTemporaryFile", refuse(reason))
    with caplog.at_level(logging.WARNING, logger="palanquin.lowering"):
        lowered = decay().lower()
    assert reason in caplog.text
    assert cache not in lowered.report.path.parents
    assert is_usable(lowered)


def test_disk_that_fills_up_while_compiling(cache, compiler, monkeypatch):
    replace = os.replace
    monkeypatch.setattr(compilation.os, "replace", refuse("No space left on device"))
    with pytest.raises(pq.LoweringError, match=r"cannot write.*No space left"):
        decay().lower()
    monkeypatch.setattr(compilation.os, "replace", replace)
    assert leftovers(cache) == []
    assert is_usable(decay().lower())


AROUND = """
import os, sys
sys.path.insert(0, sys.argv[1])
import palanquin as pq
from test_cache import decay, is_usable
first = decay().lower()
os.chdir("elsewhere")
assert is_usable(first)
assert pq.Ipopt(first, penalize=True).solve(first.parameters(), first.knot()).is_usable
again = decay().lower()
assert again.report.cache_hit
assert os.listdir(".") == []
print(again.report.path)
"""


@pytest.mark.parametrize("folder", [".", "cache", "./a/../b", "elsewhere/../cache"])
def test_relative_folders_stay_where_they_were(tmp_path, folder):
    (tmp_path / "elsewhere").mkdir()
    command = [sys.executable, "-c", AROUND, os.path.dirname(__file__)]
    done = subprocess.run(
        command, check=True, capture_output=True, text=True, cwd=tmp_path,
        env=os.environ | {"PALANQUIN_CACHE": folder},
    )  # fmt: skip
    assert Path(done.stdout.strip()).parent.samefile(tmp_path / folder)


def test_read_only_folder_of_another_user(cache, tmp_path):
    """Hits are served, misses compiled for the process alone, once, with a warning."""
    decay().lower()
    program = tmp_path / "program.py"
    program.write_text(
        "import ctypes, logging, os, sys\n"
        "if len(sys.argv) == 2:\n"
        "    # a superuser, too, loses the right to write everywhere\n"
        "    ctypes.CDLL(None).prctl(24, 1, 0, 0, 0)\n"
        "    os.execv(sys.executable, [sys.executable, *sys.argv, 'again'])\n"
        "sys.path.insert(0, sys.argv[1])\n"
        "logging.basicConfig(level=logging.WARNING)\n"
        "from test_cache import decay, is_usable\n"
        "assert decay().lower().report.cache_hit\n"
        "miss = decay(rate=0.6).lower()\n"
        "assert not miss.report.cache_hit and is_usable(miss)\n"
        "assert decay(rate=0.6).lower().report.cache_hit\n"
    )
    before = leftovers(cache)
    for path in (cache, cache / ".lock"):
        path.chmod(0o555)
    try:
        done = subprocess.run(
            [sys.executable, program, os.path.dirname(__file__)],
            check=False, capture_output=True, text=True,
        )  # fmt: skip
    finally:
        for path in (cache, cache / ".lock"):
            path.chmod(0o755)
    assert done.returncode == 0, done.stderr
    assert done.stderr.count("cannot be written") == 1
    assert leftovers(cache) == before


def test_folder_is_taken_from_the_environment(cache, monkeypatch):
    assert compilation.cache_folder() == cache
    monkeypatch.delenv("PALANQUIN_CACHE")
    assert compilation.cache_folder().name == "palanquin"


def test_run_time_changes_need_no_lowering(cache, compiler):
    lowered = decay().lower()
    solver = pq.Sqp(lowered, qp="ldl")
    parameters, measured = lowered.parameters(), lowered.knot()
    costs = []
    for name, value in (("mass", 1.0), ("mass", 3.0), ("weight", 0.1), ("dt", 0.2)):
        parameters[name] = value
        costs.append(solver.solve(parameters, measured).cost)
    assert len(set(np.round(costs, 12))) == 4
    assert compiler.compiles() == 1
