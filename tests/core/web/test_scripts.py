"""Modules of JavaScript become one script."""

from __future__ import annotations

import re
import subprocess
from pathlib import Path

import pytest

from slide_fmu.core.web.packing import MODULES, ScriptError, joined_modules
from slide_fmu.report import html_report
from tests.marks import APPS
from tests.node import node


def _write(folder: Path, **modules: str) -> Path:
    for name, text in modules.items():
        (folder / f"{name}.js").write_text(text, encoding="utf-8")
    return folder


def test_imported_modules_stand_before_those_that_import_them_and_once(tmp_path: Path) -> None:
    folder = _write(
        tmp_path,
        main='import { a } from "./a.js";\nimport { b } from "./b.js";\nconsole.log(a, b);\n',
        b='import {\n  a,\n} from "./a.js";\nexport const b = a + 1;\n',
        a="export const a = 1;\n",
    )
    script = joined_modules(folder / "main.js")
    assert script == "const a = 1;\nconst b = a + 1;\nconsole.log(a, b);\n"


def test_comments_and_indentation_are_left_out(tmp_path: Path) -> None:
    text = "// what it is\n\n/**\n * Says so.\n */\nfunction a() {\n  return 1; // one\n}\n"
    script = joined_modules(_write(tmp_path, main=text) / "main.js")
    assert script == "function a() {\nreturn 1; // one\n}\n"


@pytest.mark.parametrize(
    ("other", "said"),
    [
        ("const a = 2;\nexport const b = a;\n", "both declare a"),
        ('import { m } from "./main.js";\nexport const b = m;\n', "main -> b -> main"),
        ('import * as all from "./a.js";\nexport const b = all.a;\n', "is left in the script"),
        ("export default 1;\nexport const b = 1;\n", "is left in the script"),
        ('export const b = "</script>";\n', "is left in the script"),
    ],
)
def test_modules_that_break_a_rule_are_refused(tmp_path: Path, other: str, said: str) -> None:
    main = 'import { a } from "./a.js";\nimport { b } from "./b.js";\nexport const m = a + b;\n'
    folder = _write(tmp_path, main=main, b=other, a="export const a = 1;\n")
    with pytest.raises(ScriptError, match=said):
        joined_modules(folder / "main.js")


def test_modules_of_another_folder_are_found_by_their_path(tmp_path: Path) -> None:
    shared, own = tmp_path / "shared", tmp_path / "own"
    shared.mkdir()
    own.mkdir()
    _write(
        shared, a='import { b } from "./b.js";\nexport const a = b;\n', b="export const b = 1;\n"
    )
    text = 'import { a } from "../shared/a.js";\nimport { b } from "../shared/b.js";\nlog(a, b);\n'
    script = joined_modules(_write(own, main=text) / "main.js")
    assert script == "const b = 1;\nconst a = b;\nlog(a, b);\n"


PAGE = APPS / "page" / "web"
ENTRIES = {
    "loader": MODULES / "loader.js",
    "report": html_report.WEB / "report.js",
    **({"page": PAGE / "main.js"} if PAGE.exists() else {}),
}


@pytest.mark.parametrize("name", ENTRIES)
def test_script_of_every_page_is_one_that_node_can_read(tmp_path: Path, name: str) -> None:
    whole = tmp_path / "page.mjs"
    whole.write_text(joined_modules(ENTRIES[name]), encoding="utf-8")
    subprocess.run([node(), "--check", str(whole)], check=True)


def test_modules_are_all_joined_into_some_page() -> None:
    script = "".join(joined_modules(entry) for entry in ENTRIES.values())
    for path in (*MODULES.glob("*.js"), *PAGE.glob("*.js"), *html_report.WEB.glob("*.js")):
        text = path.read_text(encoding="utf-8")
        names = re.findall(
            r"^export (?:async )?(?:function|class|const) (\w+)", text, re.MULTILINE
        )
        assert path in ENTRIES.values() or all(f" {n}" in script for n in names), path.name
        assert text.startswith("// "), f"{path.name} does not say what it is"
