"""What a user should know about a fitted network, in a sentence for each thing."""

from __future__ import annotations

from slide_fmu.fitting.state_space.sizes import POOR

PER_PARAMETER = 10
"""Fewer samples for each parameter than these do not tell good parameters from others."""


def remark_on(
    error: float, learnable: float, parameters: int, samples: int, weighted: bool = False
) -> str | None:
    """Return what is to be said about a network; None if there is nothing.

    The error is that of the validation and ``learnable`` the part of it that could still be
    learnt, both relative to the outputs' standard deviation, and perhaps weighted by the spectrum
    of noise; ``samples`` is the number of scored values of outputs that the parameters were learnt
    from.
    """
    found = [_remark_on_error(error, learnable, weighted), remark_on_samples(parameters, samples)]
    return "; ".join(remark for remark in found if remark is not None) or None


def remark_on_samples(parameters: int, samples: int) -> str | None:
    """Tell that parameters are many beside the samples that they were learnt from."""
    if samples >= PER_PARAMETER * parameters:
        return None
    return (
        f"the network has {parameters} parameters and was learnt from {samples} samples of "
        f"outputs, {samples / parameters:.2g} for each; expected at least {PER_PARAMETER}: its "
        "validation error hardly tells how it does elsewhere; give longer records (data.train), "
        "or fewer units (network.hidden)"
    )


def _remark_on_error(error: float, learnable: float, weighted: bool) -> str | None:
    """Tell of a poor result: one whose errors the inputs could still explain in good part."""
    if learnable < POOR:
        return None
    how = ", weighted by the spectrum of the noise" if weighted else ""
    return (
        f"the network misses {100 * error:.2g} % of the outputs (RMS over standard deviation, in "
        f"validation{how}), and {100 * learnable:.2g} % could still be learnt from the inputs: "
        "give more trajectories (data.train), more units (network.hidden) or states "
        "(network.order), or more starts (training.starts)"
    )
