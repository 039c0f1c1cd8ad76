"""Modules of JavaScript become one script, and files become text that a page holds and unpacks.

The script runs in a file opened from disk. Browsers load no modules from disk, so imports are
resolved here. The modules follow a few rules: every import names what it takes, from another
module by its relative path, at the beginning of a line; exports are declarations; top-level names
are unique among all modules; comments stand on lines of their own, and no string spans several
lines. Comments and indentation are left out of the script.
"""

from __future__ import annotations

import base64
import gzip
import re
from pathlib import Path

_IMPORT = re.compile(r'^import \{[^}]*\} from "(\.[a-z_./]+\.js)";\n', re.MULTILINE)
_EXPORT = re.compile(r"^export (?=(?:async )?(?:function\*?|class|const) )", re.MULTILINE)
_NAME = re.compile(r"^(?:export )?(?:async )?(?:function\*?|class|const|let) (\w+)", re.MULTILINE)
_FOR_PEOPLE = re.compile(r"^[ \t]*(?://.*\n|/\*\*(?:.|\n)*?\*/\n)|^\s+", re.MULTILINE)


class ScriptError(RuntimeError):
    """The modules break a rule, so they cannot be joined."""


def joined_modules(entry: Path) -> str:
    """Join a module and all its imports; each module follows its imports.

    Args:
        entry: file of the module that is run.

    Raises:
        ScriptError: modules import each other in a circle, two share a top-level name, or an
            import or export is not resolved.
        FileNotFoundError: there is no such module.
    """
    texts: dict[Path, str] = {}
    _collect(entry.resolve(), (), texts)
    owners: dict[str, Path] = {}
    for module, text in texts.items():
        for name in _NAME.findall(text):
            if name in owners:
                raise ScriptError(
                    f"{owners[name].name} and {module.name} both declare {name}; expected names "
                    "of their own: rename one of them"
                )
            owners[name] = module
    whole = "".join(_EXPORT.sub("", _IMPORT.sub("", text)) for text in texts.values())
    joined = _FOR_PEOPLE.sub("", whole)
    left = re.search(r"^(?:import|export)\b.*|</script|<!--", joined, re.MULTILINE)
    if left is not None:
        raise ScriptError(
            f'{left[0]!r} is left in the script; expected import {{ names }} from "./module.js", '
            "exports of declarations, and nothing that ends a script in HTML"
        )
    return joined


def _collect(module: Path, way: tuple[Path, ...], modules: dict[Path, str]) -> None:
    """Add a module to the modules found, after all its imports."""
    if module in way:
        circle = " -> ".join(path.stem for path in (*way[way.index(module) :], module))
        raise ScriptError(f"modules import each other: {circle}; expected no circle")
    if module in modules:
        return
    text = module.read_text(encoding="utf-8")
    for other in _IMPORT.findall(text):
        _collect((module.parent / other).resolve(), (*way, module), modules)
    modules[module] = text


MODULES = Path(__file__).parent / "modules"
"""JavaScript modules and style sheets that pages share."""


def packed(content: bytes) -> str:
    """Return bytes as compressed text; ``modules/blobs.js`` unpacks it."""
    return base64.b64encode(gzip.compress(content, mtime=0)).decode("ascii")


def scripts(entry: Path) -> dict[str, str]:
    """Return the script that starts with a module, as values for a template.

    ``script`` is the whole script, compressed; ``loader`` runs it.
    """
    whole = joined_modules(entry).encode("utf-8")
    return {"script": packed(whole), "loader": joined_modules(MODULES / "loader.js")}


def styles(*own: Path) -> str:
    """Return one style sheet: colours, shared styles, and a page's own files.

    It has no comments, no indents, no spaces behind punctuation, and no semicolons before braces.
    """
    shared = (MODULES / "colours.css", MODULES / "base.css")
    whole = "".join(path.read_text(encoding="utf-8") for path in (*shared, *own))
    bare = re.sub(r"/\*.*?\*/", "", whole, flags=re.DOTALL)
    lines = (re.sub(r"(?<=[:;,{]) +| +(?=\{)", "", line.strip()) for line in bare.splitlines())
    return re.sub(r";\n?\}", "}", "\n".join(line for line in lines if line)) + "\n"
