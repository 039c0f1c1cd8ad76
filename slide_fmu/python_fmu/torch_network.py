"""The torch module in an FMU, evaluated on the CPU. Becomes part of that FMU, as its slave does.

Modules are written by others: whatever goes wrong in them is reported in one sentence.
"""

from __future__ import annotations

import os
import warnings
import zipfile
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from io import BytesIO
from pathlib import Path, PurePosixPath
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

SAME = 1e-4
"""Of scaled outputs: what the same window may give the second time, when threads sum in another
order."""

CODE = "aotinductor", "custom_obj", "opaque_obj"
"""Parts of the names of members of a ``torch.export`` archive that are no tensors or graphs."""

FORCED = "TORCH_FORCE_WEIGHTS_ONLY_LOAD"
"""The variable of the environment by which torch unpickles nothing but tensors."""


class ModuleNetwork:
    """A torch module that gives outputs for a window of inputs. Final.

    Attributes:
        identity: the bytes of its file.

    Raises:
        ValueError: the file holds no such module.
    """

    def __init__(self, folder: Path, n_outputs: int) -> None:
        self._module, self.identity = _load(folder)
        self._n_outputs = n_outputs

    def values(self, window: FloatArray) -> FloatArray:
        """Give the scaled outputs, (n_outputs,), of scaled inputs (n_in, n_inputs), both float64.

        Raises:
            ValueError: the module gives none that are finite numbers.
        """
        argument = torch.from_numpy(window.astype(np.float32))[None]
        with torch.no_grad():
            try:
                values = self._module(argument)
            except Exception as error:  # what a module raises is up to those who wrote it
                raise ValueError(
                    f"the module takes no float32 tensor of shape {tuple(argument.shape)} on the "
                    f"CPU: {_last_line(error)}"
                ) from error
        newest = _newest(values, self._n_outputs)
        if not np.all(np.isfinite(newest)):
            raise ValueError(f"the module gives {newest.tolist()}; expected finite values")
        return newest

    def require_function(self, windows: Sequence[FloatArray]) -> None:
        """Reject a module that gives something else for the same window the second time.

        Args:
            windows: scaled inputs, (n_in, n_inputs) each; others lie between the two times.

        Raises:
            ValueError: it does, or gives no outputs at all.
        """
        first = [self.values(window) for window in windows]
        for window, once in zip(windows, first, strict=True):
            again = self.values(window)
            if not np.allclose(once, again, rtol=SAME, atol=SAME):
                raise ValueError(
                    f"the module gives {once.tolist()}, then {again.tolist()} for the same "
                    "window; expected the same: it must keep no state and draw no random numbers "
                    "(call eval() before it is saved)"
                )


def _read_scripted(path: Path) -> Callable[[torch.Tensor], Any]:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)  # scripted modules are an old form
        module = torch.jit.load(path, map_location="cpu")  # type: ignore[no-untyped-call]
    return module.eval()  # type: ignore[no-any-return]


def _read_exported(path: Path) -> Callable[[torch.Tensor], Any]:
    content = _data_alone(path)
    with _only_tensors_unpickled():
        return torch.export.load(content).module()


def _data_alone(path: Path) -> BytesIO:
    """Copy an archive, so that torch finds those members in it that were looked at, and no others.

    Torch does not tell capital letters from small ones, and may look for the directory of an
    archive elsewhere than Python does.

    Raises:
        ValueError: it has compiled code, or objects other than tensors, which are pickles; the
            message names the member.
    """
    content = BytesIO()
    with zipfile.ZipFile(path) as archive, zipfile.ZipFile(content, "w") as copy:
        for name in archive.namelist():
            if any(part.startswith(CODE) for part in PurePosixPath(name.casefold()).parts):
                raise ValueError(
                    f"its member {name!r} may run any code; expected a module of tensors and "
                    "operators of torch: save one without custom objects and compiled parts"
                )
            copy.writestr(name, archive.read(name))
    content.seek(0)
    return content


@contextmanager
def _only_tensors_unpickled() -> Iterator[None]:
    """Let torch unpickle tensors only: it falls back to pickles that run any code otherwise."""
    before = os.environ.get(FORCED)
    os.environ[FORCED] = "1"
    try:
        yield
    finally:
        if before is None:
            del os.environ[FORCED]
        else:
            os.environ[FORCED] = before


_READERS = {
    "module.pt": ("torch.jit.save", _read_scripted),
    "module.pt2": ("torch.export.save", _read_exported),
}
"""Names of the module's file in the FMU: what writes it, and what reads it."""


def _load(folder: Path) -> tuple[Callable[[torch.Tensor], Any], bytes]:
    """Read the module of an FMU for the CPU, and give the bytes of its file too."""
    path = next(folder / name for name in _READERS if (folder / name).exists())
    wanted, read = _READERS[path.name]
    try:
        return read(path), path.read_bytes()
    except Exception as error:  # what torch raises depends on what the file is instead
        raise ValueError(
            f"the file cannot be read: {_last_line(error)}; expected one of {wanted}, of a module "
            "on the CPU"
        ) from error


def _newest(values: object, n_outputs: int) -> FloatArray:
    """Give the newest sample of what a module gives, shape (n_outputs,), if it gives samples."""
    if not isinstance(values, torch.Tensor):
        raise ValueError(
            f"the module gives a {type(values).__name__}; expected one tensor: wrap it in a "
            "module that picks this out"
        )
    if not values.is_floating_point() or values.device.type != "cpu":
        raise ValueError(
            f"the module gives a tensor of {values.dtype} on {values.device}; expected real "
            "numbers on the CPU"
        )
    if values.layout != torch.strided or values.is_nested:
        raise ValueError(
            "the module gives a sparse or nested tensor; expected a dense one: let it end with "
            "to_dense() or to_padded_tensor()"
        )
    flat = values.detach().reshape(-1)
    if len(flat) % n_outputs or len(flat) < n_outputs:
        raise ValueError(
            f"the module gives {len(flat)} values, shape {tuple(values.shape)}; expected a "
            f"multiple of its {n_outputs} outputs, sample by sample, the newest last"
        )
    return np.asarray(flat[-n_outputs:].double().numpy())


def _last_line(error: Exception) -> str:
    """Say what an error says, without the trace that torch puts before it."""
    lines = [line for line in str(error).strip().splitlines() if line.strip()]
    return f"{type(error).__name__}: {lines[-1].strip() if lines else ''}"
