"""Files are compressed to text that a page holds and its script unpacks."""

from __future__ import annotations

import base64
import gzip
import re
from pathlib import Path

from slide_fmu.core.web.scripts import joined_modules

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
