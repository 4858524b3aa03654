"""What the fuzzers share: a reader that gets mutated files either takes them or says what is wrong
with them by an error of its own; anything else that it raises is a finding.
"""

from __future__ import annotations

import inspect
import sys
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

import atheris
from support.mutations import garbled, mutated

from palanquin.errors import PalanquinError

SCRATCH = Path("build/fuzz")


def fuzz(
    read: Callable[[Path], Any],
    seeds: Iterable[Path],
    suffix: str,
    parse: Callable[[bytes], Any],
    dump: Callable[[Any], bytes],
    watch: tuple[str, ...],
) -> None:
    """Feeds `read` with mutations of the files `seeds`, each as a file with `suffix`, and goes on
    with those that reach new code of the modules whose names begin with one of `watch`.

    Options for libFuzzer come from the command line, `-runs=N` among them; a file there is read
    once, as it is.
    """
    name = Path(sys.argv[0]).stem.removesuffix("_fuzz")
    corpus, file = SCRATCH / f"{name}-corpus", SCRATCH / f"{name}{suffix}"
    corpus.mkdir(parents=True, exist_ok=True)
    for old in corpus.iterdir():
        old.unlink()
    for seed in seeds:
        (corpus / seed.name).write_bytes(seed.read_bytes())
    for function in functions_of(watch):
        atheris.instrument_func(function)

    def read_once(data: bytes) -> None:
        file.write_bytes(data)
        try:
            read(file)
        except PalanquinError as error:
            if not str(error).strip():
                raise AssertionError("an error without a word") from error

    def custom_mutator(data: bytes, max_size: int, seed: int) -> bytes:
        try:
            changed = dump(mutated(parse(data), seed)) if seed % 4 else garbled(data, seed)
        except Exception:  # it can't be parsed, or not be written any more
            changed = garbled(data, seed)
        return changed if len(changed) <= max_size else data

    files = [argument for argument in sys.argv[1:] if not argument.startswith("-")]
    arguments = sys.argv if files else [*sys.argv, str(corpus)]
    atheris.Setup(arguments, read_once, custom_mutator=custom_mutator)
    atheris.Fuzz()


def functions_of(modules: tuple[str, ...]) -> list[Callable[..., Any]]:
    """Functions and methods of the loaded modules; atheris can't instrument an editable package
    while it is imported.
    """
    found = {}
    for name, module in list(sys.modules.items()):
        if name.startswith(modules):
            places = [module, *(c for _, c in inspect.getmembers(module, inspect.isclass))]
            for place in places:
                for _, function in inspect.getmembers(place, inspect.isroutine):
                    function = getattr(function, "__func__", function)
                    if inspect.isfunction(function) and function.__module__.startswith(modules):
                        found[id(function)] = function
    return list(found.values())
