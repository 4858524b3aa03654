"""The reference of scenario files as Markdown, from their JSON schema."""

from __future__ import annotations

import json
from collections.abc import Iterator
from typing import Any

Schema = dict[str, Any]


def reference(schema: Schema) -> str:
    """A section with a table of fields for the scenario and for each of its parts."""
    parts = {"A scenario": schema, **schema["$defs"]}
    return "\n".join(line for name, part in parts.items() for line in _section(name, part))


def _section(name: str, part: Schema) -> Iterator[str]:
    part = next((option for option in part.get("anyOf", []) if "properties" in option), part)
    if "properties" not in part:
        return
    yield from (f"## {name}", "", part.get("description", "").split("\n\n")[0], "")
    yield from ("| field | kind | default | meaning |", "|---|---|---|---|")
    for field, value in part["properties"].items():
        default = "needed" if field in part.get("required", []) else _default(value)
        meaning = value.get("description", "")
        yield f"| `{field}` | {_kind(value)} | {default} | {meaning} |"
    yield ""


def _kind(value: Schema) -> str:
    """What a value is, in a few words."""
    for key in ("anyOf", "oneOf", "allOf"):
        if key in value:
            kinds = (_kind(option) for option in value[key] if option.get("type") != "null")
            return " or ".join(dict.fromkeys(kinds))
    if "$ref" in value:
        return str(value["$ref"].rsplit("/", 1)[-1])
    if "const" in value or "enum" in value:
        return " or ".join(f"`{choice}`" for choice in value.get("enum", [value.get("const")]))
    if value.get("type") == "array":
        entries = value.get("items") or value["prefixItems"][0]
        count = f"{value['maxItems']} x " if "prefixItems" in value else "list of "
        return count + _kind(entries)
    return str(value.get("type", "anything")) + _range(value)


def _range(value: Schema) -> str:
    words = {"exclusiveMinimum": "over", "minimum": "at least", "maximum": "at most"}
    limits = [f"{word} {value[key]:g}" for key, word in words.items() if key in value]
    return f" {', '.join(limits)}" if limits else ""


def _default(value: Schema) -> str:
    default = value.get("default")
    if isinstance(default, dict):
        return ""  # a part of its own, with its own defaults
    return "" if default is None else f"`{json.dumps(default)}`"
