"""Descriptions of torch modules and options of their export: mistakes are named."""

from __future__ import annotations

from pathlib import Path

import pytest

from slide_fmu.python_fmu.torch_export import ModuleError, export_module
from tests.fmu.samples import STEP
from tests.python_fmu.modules import (
    invoke,
    saved,
    surrogate_with,
)


def test_backend_refuses_what_it_cannot_make(tmp_path: Path) -> None:
    module, description = saved(surrogate_with("zero_order"), tmp_path, ".pt")
    refused = invoke("export", module, "-o", tmp_path / "m.fmu")
    assert refused.exit_code == 1
    assert "add --backend python" in refused.output
    other = invoke("export", tmp_path / "recipe.toml", "--backend", "python")
    assert other.exit_code == 1
    assert "takes a torch module" in other.output
    about = ("--backend", "python", "--description", description, "-o", tmp_path / "m.fmu")
    for form in (("--fmi", 3), ("--source",)):
        native = invoke("export", module, *about, *form)
        assert native.exit_code == 1
        assert "which are for native FMUs" in native.output
    without = invoke("export", module, "--backend", "python", "-o", tmp_path / "m.fmu")
    assert without.exit_code == 1
    assert "--description" in without.output


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("n_in = 12", "n_in = 0", "window.n_in = 0"),
        ("n_in = 12", "n_in = 1000000000", "n_in = 1000000000: expected at most 1048576"),
        ("n_in = 12", "n_in = true", "window.n_in = true: expected a whole number"),
        ("n_in = 12", "n_in = 12.0", "window.n_in = 12.0: expected a whole number"),
        (f"step = {STEP}", "step = true", "window.step = true: expected a number"),
        (
            "low = -2.0",
            "low = false",
            r"toml, line \d+: 1st \[\[inputs\]\], key low = false: expected a number",
        ),
        ("low = -2.0", f"low = -1{'0' * 400}", r"1st \[\[inputs\]\], key low"),
        ("low = -2.0", f"low = {'9' * 5000}", "signals.toml: not valid TOML"),
        ('hold = "zero_order"', f"hold = {'[' * 100_000}", "signals.toml: not valid TOML"),
        ("n_in = 12", "n_in = 12\nn_im = 3", "window.n_im is not a known key"),
        ("n_in = 12", "n_in = 7", "mat1 and mat2|size|shape|expected"),
        ('name = "u1"', 'name = "u0"', "signals.toml: module: two variables have the name 'u0'"),
        ('hold = "zero_order"', 'hold = "sometimes"', "hold = 'sometimes'"),
        ("low = -2.0", "low = 4.0", "expected two finite numbers"),
        ('name = "twin"', "name = 'twin", "not valid TOML"),
    ],
)
def test_mistake_in_a_description_is_named(
    old: str, new: str, message: str, tmp_path: Path
) -> None:
    module, description = saved(surrogate_with("zero_order"), tmp_path, ".pt")
    text = description.read_text(encoding="utf-8")
    assert old in text
    description.write_text(text.replace(old, new), encoding="utf-8")
    with pytest.raises(ModuleError, match=message):
        export_module(module, description, tmp_path / "m.fmu")
    assert not (tmp_path / "m.fmu").exists()
