"""Writes the classes of `runout.loaders`, `.preprocessors`, … from schemas/: `python python/tools/generate.py`.

With `--check` it writes nothing, and fails where a file is stale.
"""

from __future__ import annotations

import json
import keyword
import sys
import textwrap
from pathlib import Path
from typing import Any

HERE = Path(__file__).resolve().parent.parent
SCHEMAS = HERE.parent / "schemas"
MODULES = {
    "loaders": ("load", "From files to recordings or points."),
    "preprocessors": ("preprocess", "From samples to profiles."),
    "separators": ("separate", "From profiles or points to form and motion."),
    "evaluators": ("evaluator", "From the tables of a result to values."),
    "exporters": ("export", "From results to files."),
    "effects": ("effect", "What models of a pipeline's own may lack."),
    "checks": ("check", "What `check` compares a pipeline with."),
}
TABLES = ("rig", "surface", "evaluate", "limit", "diagnose", "report")
HEAD = '''"""{about}

Generated from schemas/ by python/tools/generate.py: every class has the keys of its table in TOML. A key that is None is left out.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from typing import Any, ClassVar, Literal, Union
'''


def class_name(text: str) -> str:
    name = "".join(word.capitalize() for word in text.split("-"))
    return name if name.isidentifier() else f"Format{name}"


def type_of(schema: Any) -> str:
    """The annotation of what a schema allows."""
    if not isinstance(schema, dict):
        return "Any"
    if "const" in schema:
        return f"Literal[{schema['const']!r}]"
    if "enum" in schema:
        return f"Literal[{', '.join(repr(one) for one in schema['enum'] if one is not None)}]"
    choices = schema.get("anyOf") or schema.get("oneOf")
    if choices:
        found = [type_of(choice) for choice in choices if choice.get("type") != "null"]
        return union(found)
    kinds = schema.get("type", "any")
    return union([of_kind(kind, schema) for kind in ([kinds] if isinstance(kinds, str) else kinds) if kind != "null"])


def union(found: list[str]) -> str:
    found = list(dict.fromkeys(found))
    return found[0] if len(found) == 1 else f"Union[{', '.join(found)}]"


def of_kind(kind: str, schema: dict[str, Any]) -> str:
    match kind:
        case "string":
            return "str"
        case "number":
            return "float"
        case "integer":
            return "int"
        case "boolean":
            return "bool"
        case "array":
            return f"Sequence[{type_of(schema.get('items', {}))}]"
        case "object":
            return "Mapping[str, Any]"
        case _:
            return "Any"


def paragraph(text: str, indent: str) -> str:
    flat = " ".join(text.replace("\\", "\\\\").replace('"""', "'''").split())
    return textwrap.fill(flat, 128, initial_indent=indent, subsequent_indent=indent)


def code_of(name: str, about: str, schema: dict[str, Any], plugin: str | None) -> str:
    """A class with the keys of a table."""
    lines = ["", "", "@dataclasses.dataclass(frozen=True, kw_only=True)", f"class {name}:"]
    about = about or "Keys of the table."
    lines += ['    """' + paragraph(about[0].upper() + about[1:], "    ").strip() + '"""', ""]
    if plugin is not None:
        lines += [f'    plugin: ClassVar[str] = "{plugin}"', ""]
    required = schema.get("required", [])
    for key, of in schema.get("properties", {}).items():
        if key == "plugin":
            continue
        if keyword.iskeyword(key) or not key.isidentifier():
            raise ValueError(f"{name}: `{key}` is no name of Python's")
        kind = type_of(of)
        lines.append(f"    {key}: {kind}" if key in required else f"    {key}: Union[{kind}, None] = None")
        described = of.get("description", "") if isinstance(of, dict) else ""
        default = of.get("default") if isinstance(of, dict) else None
        if default is not None and not isinstance(default, (dict, list)):
            described += f" Default: {json.dumps(default)}."
        if described:
            lines += ['    """' + paragraph(described, "    ").strip() + '"""', ""]
    while lines[-1] == "":
        lines.pop()
    if len(lines) == 5:
        lines.append("")
    return "\n".join(lines).rstrip() + "\n"


def modules() -> dict[Path, str]:
    properties = json.loads((SCHEMAS / "pipeline.schema.json").read_text("utf-8"))["properties"]
    written = {}
    for module, (stage, about) in MODULES.items():
        schema = properties[stage]
        schema = schema.get("items", schema)
        text = HEAD.format(about=about)
        for variant in schema["oneOf"]:
            plugin = variant["properties"]["plugin"]["const"]
            text += code_of(class_name(plugin), variant.get("description", ""), variant, plugin)
        written[HERE / "runout" / f"{module}.py"] = text
    text = HEAD.format(about="The tables of a pipeline that name no plugin.")
    for name in TABLES:
        schema = properties[name]
        schema = schema.get("items", schema)
        schema = next((one for one in schema.get("anyOf", []) if one.get("properties")), schema)
        about = schema.get("description") or f"`[{name}]`."
        text += code_of(class_name(name), about, schema, None)
    written[HERE / "runout" / "tables.py"] = text
    return written


def main(words: list[str]) -> int:
    stale = [path for path, text in modules().items() if not path.is_file() or path.read_text("utf-8") != text]
    if words == ["--check"]:
        for path in stale:
            print(f"{path.name} is stale: run python python/tools/generate.py", file=sys.stderr)
        return 1 if stale else 0
    for path, text in modules().items():
        path.write_text(text, "utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
