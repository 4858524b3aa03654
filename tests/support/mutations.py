"""What users' files become by mistake: seeded mutations of data and of text."""

import copy
import os
import random

RUNS = int(os.environ.get("PALANQUIN_MUTATIONS", "150"))
"""How many mutations a test tries; thousands by hand."""

VALUES = (
    None, True, False, "", "x", "1", [], {}, [1], {"a": 1}, [None], [[1, 2], [3]], [0, 0, 0], -1,
    0, 1, 2, 17, 0.5, -0.5, 1e-3, 1e-9, 1e6, -1e6, 1e15, -1e15, 1e308, -1e308, 1e-308, 10**30,
    -(10**30), 10**400, float("nan"), float("inf"), -float("inf"), "\x00", "\u00e9" * 50,
)  # fmt: skip

PIECES = (
    b"\x00", b"\xff", b"\xef\xbb\xbf", b"{", b"[", b"&a ", b"*a", b"<<: ", b"!!set ", b"!!binary ",
    b"? ", b"- ", b": ", b"\t", b"\r", b"---\n", b"1e999", b".nan", b"~", b"2001-01-01", b'"', b"|",
    b"1" * 5000, b"!!python/object:os.system", b"\xe2\x80\xa8", b"@", b'!!int "x"', b"1_0",
)  # fmt: skip


def mutated(data, seed, most=3):
    """A copy of nested dicts and lists with one to `most` entries changed."""
    data, rng = copy.deepcopy(data), random.Random(seed)
    for _ in range(rng.randint(1, most)):
        parent, key = _place(data, rng)
        if parent is None:
            break
        rng.choice((_replace, _replace, _replace, _scale, _scale, _drop, _add, _swap))(
            parent, key, rng
        )
    return data


def garbled(text, seed):
    """Bytes with a few of them changed, inserted, deleted, cut off or repeated."""
    data, rng = bytearray(text), random.Random(seed)
    for _ in range(rng.randint(1, 4)):
        i, j = (rng.randrange(len(data) + 1) for _ in range(2))
        kind = rng.randrange(5)
        if kind == 0:
            data[i : i + 1] = bytes([rng.randrange(256)])
        elif kind == 1:
            data[i : i + rng.choice((0, 3))] = rng.choice(PIECES)
        elif kind == 2:
            del data[i : i + rng.choice((1, 3, 20, 500))]
        elif kind == 3:
            del data[i:]
        else:
            data[i:i] = data[j : j + 30]
    return bytes(data)


def _place(data, rng):
    """A container somewhere in `data` and a key of it, deep ones as often as shallow ones."""
    parent, key, node = None, None, data
    while isinstance(node, dict | list) and node and (parent is None or rng.random() < 0.8):
        parent, key = node, rng.choice(list(node) if isinstance(node, dict) else range(len(node)))
        node = parent[key]
    return parent, key


def _replace(parent, key, rng):
    parent[key] = copy.deepcopy(rng.choice(VALUES))


def _scale(parent, key, rng):
    value = parent[key]
    if isinstance(value, int | float) and not isinstance(value, bool) and abs(value) < 1e300:
        parent[key] = rng.choice((1e3, -1, 1e-3, 1e6, 10, 2)) * value
    else:
        _replace(parent, key, rng)


def _drop(parent, key, rng):
    del parent[key]


def _add(parent, key, rng):
    if isinstance(parent, dict):
        parent[rng.choice(("x", "name", "type", ""))] = copy.deepcopy(rng.choice(VALUES))
    else:
        parent.insert(key, copy.deepcopy(rng.choice((*VALUES, parent[key]))))


def _swap(parent, key, rng):
    other = rng.choice(list(parent) if isinstance(parent, dict) else range(len(parent)))
    parent[key], parent[other] = parent[other], parent[key]
