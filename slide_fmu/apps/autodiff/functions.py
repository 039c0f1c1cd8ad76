"""A surrogate as a function of torch or of CasADi; each is imported when it is asked for."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from slide_fmu.surrogate.surrogate import Surrogate

if TYPE_CHECKING:
    import torch

    from slide_fmu.apps.autodiff.device_surrogate import DeviceSurrogate


def torch_module(surrogate: Surrogate, threads: int | None = None) -> torch.nn.Module:
    """Return a surrogate as a torch module: whole records in, outputs out, and their gradient.

    It maps records of shape (B, N, n_inputs), or (N, n_inputs) of one, to outputs at samples
    1 .. N, in the signals' units, as ``NativeSurrogate.predict`` does, and keeps type, one with
    fractions, and device.
    It has no weights to train; ``backward`` gives the gradient by the records, of which there are
    no second derivatives. Outputs have single precision, gradients double precision.

    Args:
        surrogate: what predicts; its physical parameters have their start values
            (``Surrogate.at`` fixes others). Of other families than ``state_space`` there are no
            gradients.
        threads: that share the records; one per core if None.

    Raises:
        ImportError: torch is not installed.
        NativeError: there is no compiled library, or it refuses the surrogate.
    """
    try:
        from slide_fmu.apps.autodiff.torch_surrogate import TorchSurrogate
    except ImportError as error:
        raise ImportError(_missing("torch_module", "torch", "train")) from error
    return TorchSurrogate(surrogate, threads)


def device_surrogate(surrogate: Surrogate, device: str = "cuda") -> DeviceSurrogate:
    """Return a surrogate on a device of torch, which predicts very many records side by side.

    ``predict`` maps records of shape (B, N, n_inputs) to outputs at samples 1 .. N, shape
    (B, N, n_outputs), in the signals' units, as ``NativeSurrogate.predict`` does. Features are
    formed by numpy; the network runs on the device, in single precision.

    Args:
        surrogate: what predicts, of the family ``state_space``; its physical parameters have
            their start values (``Surrogate.at`` fixes others).
        device: as torch names it: ``cuda``, ``cuda:1``, ``cpu``.

    Raises:
        ImportError: torch is not installed.
        TypeError: the surrogate is of another family.
        ValueError: torch finds no such device.
    """
    try:
        from slide_fmu.apps.autodiff.device_surrogate import DeviceSurrogate
    except ImportError as error:
        raise ImportError(_missing("device_surrogate", "torch", "train")) from error
    return DeviceSurrogate(surrogate, device)


def casadi_function(
    surrogate: Surrogate, samples: int, options: dict[str, object] | None = None
) -> Any:
    """Return a surrogate as a ``casadi.Function`` with derivatives in reverse mode.

    It maps one record, a matrix (samples, n_inputs), to outputs (samples, n_outputs), in the
    signals' units, as ``NativeSurrogate.predict`` does, and can be called with ``casadi.MX``. It
    has first derivatives only: ipopt needs ``{"ipopt.hessian_approximation": "limited-memory"}``.
    Outputs have single precision, derivatives double precision. CasADi keeps no reference to it:
    keep it as long as a solver needs it.

    Args:
        surrogate: what predicts, of the family ``state_space``; its physical parameters have
            their start values (``Surrogate.at`` fixes others).
        samples: of the record.
        options: of ``casadi.Callback``.

    Raises:
        ImportError: casadi is not installed.
        ValueError: ``samples`` is no whole number of at least 1.
        NativeError: there is no compiled library, or it has no derivatives of the surrogate.
    """
    try:
        from slide_fmu.apps.autodiff.casadi_surrogate import CasadiSurrogate
    except ImportError as error:
        raise ImportError(_missing("casadi_function", "casadi", "casadi")) from error
    return CasadiSurrogate(surrogate, samples, options)


def _missing(function: str, package: str, extra: str) -> str:
    return (
        f"{function} needs the package {package!r}, which cannot be imported: "
        f"pip install 'slide-fmu[{extra}]'"
    )
