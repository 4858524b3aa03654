"""A lowered problem as one folder that travels."""

from __future__ import annotations

import os
import shutil
import tempfile
from pathlib import Path
from string import Template

from palanquin.code import KINDS, MANIFEST, Code
from palanquin.compilation import DEFAULT_FLAGS
from palanquin.errors import LoweringError

_TEMPLATES = Path(__file__).with_name("templates")


def write_folder(folder: Path, code: Code, library: Path) -> Path:
    """Writes code, manifest, build files and the compiled `library` of kind "sqp" to a folder.

    Files appear one by one and whole, the manifest last; compiled libraries of what was saved there
    before go first.

    Raises:
        LoweringError: the folder is a file or holds other things, or cannot be written.
    """
    sources = {kind: code.source(kind) for kind in KINDS}
    names = {
        "name": code.name,
        "kinds": " ".join(KINDS),
        "flags": " ".join(f for f in DEFAULT_FLAGS if f not in ("-shared", "-fPIC")),
    }
    texts = {f"{kind}.c": source for kind, source in sources.items()}
    for template in ("CMakeLists.txt", "README.md"):
        text = (_TEMPLATES / f"{template}.in").read_text(encoding="utf-8")
        texts[template] = Template(text).substitute(names)
    texts[MANIFEST] = code.manifest
    try:
        _make_room(folder, set(texts))
        _write(folder, texts, library)
    except OSError as error:
        raise LoweringError(f"cannot save '{code.name}' in '{folder}': {error}") from error
    return folder


def _make_room(folder: Path, names: set[str]) -> None:
    if folder.exists() and not folder.is_dir():
        raise LoweringError(f"cannot save in '{folder}': it is a file")
    folder.mkdir(parents=True, exist_ok=True)
    if any(folder.iterdir()) and not (folder / MANIFEST).is_file():
        raise LoweringError(f"cannot save in '{folder}': it holds files of something else")
    for kind in KINDS:
        (folder / f"{kind}.so").unlink(missing_ok=True)


def _write(folder: Path, texts: dict[str, str], library: Path) -> None:
    with tempfile.TemporaryDirectory(dir=folder, prefix=".save-") as work:
        for name, text in texts.items():
            (Path(work) / name).write_text(text, encoding="utf-8")
        shutil.copyfile(library, Path(work) / "sqp.so")
        for name in ("sqp.so", *texts):
            os.replace(Path(work) / name, folder / name)
