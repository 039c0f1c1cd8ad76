"""A surrogate becomes a function of torch or CasADi, which are imported when needed."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from slide_fmu.surrogate.surrogate import Surrogate

if TYPE_CHECKING:
    import torch

    from slide_fmu.apps.autodiff.device_surrogate import DeviceSurrogate


def torch_module(surrogate: Surrogate, threads: int | None = None) -> torch.nn.Module:
    """Return a surrogate as a torch module: whole sequences in, outputs out, and their gradient.

    It maps sequences of shape (B, N, n_inputs), or (N, n_inputs) of one, to outputs at samples 1
    .. N, in the signals' units, as ``NativeSurrogate.predict`` does. It keeps the floating-point
    type and the device. It has no weights to train; ``backward`` gives the gradient by the
    sequences, without second derivatives. Outputs have single precision, gradients double
    precision.

    Args:
        surrogate: the surrogate; its physical parameters have their start values (``Surrogate.at``
            fixes others). Only the family ``state_space`` has gradients.
        threads: number of threads that share the sequences; one per core if None.

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
    """Return a surrogate on a torch device, which predicts many sequences in parallel.

    ``predict`` maps sequences of shape (B, N, n_inputs) to outputs at samples 1 .. N, shape (B, N,
    n_outputs), in the signals' units, as ``NativeSurrogate.predict`` does. Features are formed by
    numpy; the network runs on the device, in single precision.

    Args:
        surrogate: a surrogate of the family ``state_space``; its physical parameters have their
            start values (``Surrogate.at`` fixes others).
        device: a torch device: ``cuda``, ``cuda:1``, ``cpu``.

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

    It maps one sequence, a matrix (samples, n_inputs), to outputs (samples, n_outputs), in the
    signals' units, as ``NativeSurrogate.predict`` does, and can be called with ``casadi.MX``. It
    has first derivatives only: ipopt needs ``{"ipopt.hessian_approximation": "limited-memory"}``.
    Outputs have single precision, derivatives double precision. CasADi keeps no reference to it:
    the caller must keep it as long as a solver needs it.

    Args:
        surrogate: a surrogate of the family ``state_space``; its physical parameters have their
            start values (``Surrogate.at`` fixes others).
        samples: length of the sequence.
        options: options of ``casadi.Callback``.

    Raises:
        ImportError: casadi is not installed.
        ValueError: ``samples`` is not a whole number of at least 1.
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
