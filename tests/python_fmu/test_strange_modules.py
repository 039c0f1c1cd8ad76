"""Torch modules that no FMU can carry are refused at export, in one sentence."""

from __future__ import annotations

import contextlib
import io
import json
import pathlib
import pickle
import zipfile
from collections.abc import Callable
from pathlib import Path

import pytest
import torch
from torch import nn

from slide_fmu.python_fmu.torch_export import ModuleError, export_module
from tests.python_fmu.modules import save_exported, script, small_description

DESCRIPTION = small_description("strange", 1.0, ("y", "z"))


class WithValues(nn.Module):
    """Gives some number of values."""

    def __init__(self, count: int, dtype: torch.dtype = torch.float32) -> None:
        super().__init__()
        self.linear = nn.Linear(4, count, dtype=dtype)

    def forward(self, window: torch.Tensor) -> torch.Tensor:
        return self.linear(window.reshape(1, 4))


class WithDictionary(nn.Module):
    def forward(self, window: torch.Tensor) -> dict[str, torch.Tensor]:
        return {"y": window[:, :, 0], "z": window[:, :, 0]}


class WithPair(nn.Module):
    def forward(self, window: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
        return window[:, :, 0] + 1, window[:, :, 0]


class WithNumbersOfSamples(nn.Module):
    def forward(self, window: torch.Tensor) -> torch.Tensor:
        return (window[:, :2, 0] > 0).to(torch.int64)


class WithoutNumbers(nn.Module):
    def forward(self, window: torch.Tensor) -> torch.Tensor:
        return torch.log(window[:, :2, 0] - 5)


class WithNoise(nn.Module):
    def forward(self, window: torch.Tensor) -> torch.Tensor:
        return window[:, :2, 0] + torch.rand_like(window[:, :2, 0])


class WithMemory(nn.Module):
    """Counts its calls."""

    def __init__(self) -> None:
        super().__init__()
        self.calls: torch.Tensor
        self.register_buffer("calls", torch.zeros(1))

    def forward(self, window: torch.Tensor) -> torch.Tensor:
        self.calls.add_(1.0)
        return window[:, :2, 0] + self.calls


class WithMemoryOfLargeInputs(nn.Module):
    """Counts the calls with inputs away from 0."""

    def __init__(self) -> None:
        super().__init__()
        self.calls: torch.Tensor
        self.register_buffer("calls", torch.zeros(1))

    def forward(self, window: torch.Tensor) -> torch.Tensor:
        self.calls.add_((window.abs().max() > 0.1).to(torch.float32))
        return window[:, :2, 0] + self.calls


class WithMemoryOfTheLastCall(nn.Module):
    """Gives the same the second time, something else after another window."""

    def __init__(self) -> None:
        super().__init__()
        self.last: torch.Tensor
        self.register_buffer("last", torch.zeros(1, 4, 1))
        self.register_buffer("given", torch.zeros(1, 2))

    def forward(self, window: torch.Tensor) -> torch.Tensor:
        if not torch.equal(window, self.last):
            self.given.copy_(window[:, :2, 0] + self.last[:, :2, 0])
            self.last.copy_(window)
        return self.given.clone()


class WithALimit(nn.Module):
    def forward(self, window: torch.Tensor) -> torch.Tensor:
        if window.abs().max() > 0.5:
            raise ValueError("too far")
        return window[:, :2, 0]


class WithSparseOutputs(nn.Module):
    def forward(self, window: torch.Tensor) -> torch.Tensor:
        return window[:, :2, 0].to_sparse()


class WithParameter(nn.Module):
    def __init__(self) -> None:
        super().__init__()
        self.weight = nn.Parameter(torch.ones(1, 2))

    def forward(self, window: torch.Tensor) -> torch.Tensor:
        return self.weight


class WithTwoArguments(nn.Module):
    def forward(self, window: torch.Tensor, time: torch.Tensor) -> torch.Tensor:
        return window[:, :2, 0] + time


def refusal(module: Path, folder: Path) -> str:
    """What is said about a file; no FMU is left."""
    description = folder / "signals.toml"
    description.write_text(DESCRIPTION, encoding="utf-8")
    with pytest.raises(ModuleError) as caught:
        export_module(module, description, folder / "strange.fmu")
    assert not (folder / "strange.fmu").exists()
    text = str(caught.value)
    assert text.startswith(f"{module}: ")
    assert "\n" not in text
    return text


BOTH = [(script, ".pt"), (save_exported, ".pt2")]


@pytest.mark.parametrize(("save", "suffix"), BOTH, ids=["scripted", "exported"])
@pytest.mark.parametrize(
    ("module", "message"),
    [
        (WithValues(3), "gives 3 values, shape (1, 3); expected a multiple of its 2 outputs"),
        (WithValues(1), "gives 1 values, shape (1, 1); expected a multiple of its 2 outputs"),
        (WithDictionary(), "gives a dict; expected one tensor"),
        (WithPair(), "gives a tuple; expected one tensor"),
        (WithNumbersOfSamples(), "torch.int64 on cpu; expected real numbers on the CPU"),
        (WithoutNumbers(), "gives [nan, nan]; expected finite values"),
        (WithNoise(), "expected the same: it must keep no state and draw no random numbers"),
        (WithMemory(), "expected the same: it must keep no state and draw no random numbers"),
    ],
    ids=lambda value: type(value).__name__ if isinstance(value, nn.Module) else "",
)
def test_module_that_gives_no_outputs_is_refused(
    module: nn.Module,
    message: str,
    save: Callable[[nn.Module, Path], None],
    suffix: str,
    tmp_path: Path,
) -> None:
    path = tmp_path / f"strange{suffix}"
    save(module, path)
    assert message in refusal(path, tmp_path)


@pytest.mark.parametrize(
    ("module", "message"),
    [
        (WithMemoryOfLargeInputs(), "expected the same: it must keep no state"),
        (WithMemoryOfTheLastCall(), "expected the same: it must keep no state"),
        (WithALimit(), "too far"),
        (WithSparseOutputs(), "gives a sparse or nested tensor; expected a dense one"),
    ],
    ids=lambda value: type(value).__name__ if isinstance(value, nn.Module) else "",
)
def test_modules_are_tried_on_their_range(module: nn.Module, message: str, tmp_path: Path) -> None:
    path = tmp_path / "strange.pt"
    script(module, path)
    assert message in refusal(path, tmp_path)


def test_outputs_may_be_parameters(tmp_path: Path) -> None:
    path, description = tmp_path / "fine.pt", tmp_path / "signals.toml"
    script(WithParameter(), path)
    description.write_text(DESCRIPTION, encoding="utf-8")
    export_module(path, description, tmp_path / "fine.fmu")


@pytest.mark.parametrize("module", [WithTwoArguments(), WithValues(2, torch.float64)])
def test_module_that_takes_something_else_is_refused(module: nn.Module, tmp_path: Path) -> None:
    path = tmp_path / "strange.pt"  # torch.export refuses to export these
    script(module, path)
    assert "takes no float32 tensor of shape (1, 4, 1) on the CPU" in refusal(path, tmp_path)


@pytest.mark.skipif(not torch.cuda.is_available(), reason="no CUDA device")
def test_scripted_module_comes_to_the_cpu(tmp_path: Path) -> None:
    path, description = tmp_path / "fine.pt", tmp_path / "signals.toml"
    script(WithValues(2).to("cuda"), path)
    description.write_text(DESCRIPTION, encoding="utf-8")
    export_module(path, description, tmp_path / "fine.fmu")


class Trap:
    """Writes a file when it is unpickled."""

    def __init__(self, sprung: Path) -> None:
        self._sprung = sprung

    def __reduce__(self) -> tuple[Callable[..., object], tuple[object, ...]]:
        return pathlib.Path.touch, (self._sprung,)


def with_member(source: Path, target: Path, end_of_name: str, content: bytes) -> None:
    """Copy an archive; the member whose name ends so has other content, or comes to the rest."""
    with zipfile.ZipFile(source) as old, zipfile.ZipFile(target, "w") as new:
        names = old.namelist()
        found = [name for name in names if name.endswith(end_of_name)]
        changed = found[0] if found else f"{names[0].split('/')[0]}/{end_of_name}"
        for name in names:
            if name != changed:
                new.writestr(name, old.read(name))
        new.writestr(changed, content)


def test_pickle_in_an_exported_module_is_refused_and_does_not_run(tmp_path: Path) -> None:
    fine, path, sprung = tmp_path / "fine.pt2", tmp_path / "strange.pt2", tmp_path / "sprung"
    save_exported(WithValues(2), fine)
    trap = io.BytesIO()
    torch.save((Trap(sprung),), trap)
    with_member(fine, path, "data/sample_inputs/model.pt", trap.getvalue())
    assert "the file cannot be read" in refusal(path, tmp_path)
    assert not sprung.exists()
    torch.load(io.BytesIO(trap.getvalue()), weights_only=False)  # the trap works
    assert sprung.exists()


def with_trap(fine: Path, member: str, sprung: Path) -> bytes:
    """An exported module whose constants name a pickle, which lies in a member."""
    with zipfile.ZipFile(fine) as archive:
        members = {name: archive.read(name) for name in archive.namelist()}
    (config,) = (name for name in members if name.endswith("constants_config.json"))
    constants = json.loads(members[config])
    constants["config"]["trap"] = {
        **{"path_name": "opaque_obj_0", "use_pickle": True},
        **{"is_param": False, "tensor_meta": None},
    }
    members[config] = json.dumps(constants).encode()
    members[f"{config.split('/')[0]}/{member}"] = pickle.dumps(Trap(sprung))
    content = io.BytesIO()
    with zipfile.ZipFile(content, "w") as archive:
        for name, data in members.items():
            archive.writestr(name, data)
    return content.getvalue()


def test_pickle_under_a_name_in_capital_letters_is_refused_and_does_not_run(
    tmp_path: Path,
) -> None:
    fine, path, sprung = tmp_path / "fine.pt2", tmp_path / "strange.pt2", tmp_path / "sprung"
    save_exported(WithValues(2), fine)
    path.write_bytes(with_trap(fine, "data/constants/OPAQUE_obj_0", sprung))
    assert "OPAQUE_obj_0' may run any code" in refusal(path, tmp_path)
    assert not sprung.exists()
    with contextlib.suppress(Exception):  # the trap works
        torch.export.load(path)
    assert sprung.exists()


def test_pickle_in_an_archive_with_two_directories_does_not_run(tmp_path: Path) -> None:
    """Torch reads the directory that the archive's end tells, Python that which is before it."""
    fine, path, sprung = tmp_path / "fine.pt2", tmp_path / "strange.pt2", tmp_path / "sprung"
    save_exported(WithValues(2), fine)
    trap = with_trap(fine, "data/constants/opaque_obj_0", sprung)
    path.write_bytes(trap[:-22] + with_trap(fine, "data/constants/other_file_0", sprung))
    assert "the file cannot be read" in refusal(path, tmp_path)
    assert not sprung.exists()
    with contextlib.suppress(Exception):  # the trap works
        torch.export.load(path)
    assert sprung.exists()


@pytest.mark.parametrize(
    "member", ["data/constants/custom_obj_0", "data/aotinductor/model/code.wrapper.so"]
)
def test_exported_module_with_code_is_refused(member: str, tmp_path: Path) -> None:
    fine, path = tmp_path / "fine.pt2", tmp_path / "strange.pt2"
    save_exported(WithValues(2), fine)
    with_member(fine, path, member, b"anything")
    assert f"{member}' may run any code" in refusal(path, tmp_path)


def test_module_on_another_device_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "strange.pt2"
    module = WithValues(2).to("meta")
    exported = torch.export.export(module, (torch.zeros(1, 4, 1, device="meta"),))
    torch.export.save(exported, path)
    assert "on the CPU: RuntimeError: Tensor on device meta" in refusal(path, tmp_path)


@pytest.mark.parametrize("suffix", [".pt", ".pt2"])
@pytest.mark.parametrize("content", ["text", "weights", "nothing"])
def test_file_that_is_no_module_is_refused(content: str, suffix: str, tmp_path: Path) -> None:
    path = tmp_path / f"strange{suffix}"
    if content == "weights":
        torch.save(WithValues(2).state_dict(), path)
    else:
        path.write_bytes(b"no module at all" if content == "text" else b"")
    said = refusal(path, tmp_path)
    assert "the file cannot be read" in said
    assert f"expected one of torch.{'jit' if suffix == '.pt' else 'export'}.save" in said
