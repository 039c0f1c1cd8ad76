"""A chain of steps, as other programs write networks, becomes a feed-forward network.

Steps that only scale are folded into the next linear step, in double precision. The weights are
rounded to single precision at the end, as the runtime computes.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from slide_fmu.core.scaling import Affine
from slide_fmu.core.signals import FloatArray
from slide_fmu.core.window import Window
from slide_fmu.features.differences import Differences
from slide_fmu.features.feature_map import FeatureMap
from slide_fmu.network.feed_forward.network import FeedForward, Layer


@dataclass(frozen=True, eq=False)
class Linear:
    """A Linear step gives W x + b, with weights W (n_out, n_in) and bias b (n_out,)."""

    weights: FloatArray
    bias: FloatArray


@dataclass(frozen=True, eq=False)
class Scaling:
    """A Scaling step gives factor * x + shift, value by value.

    Both have the shape (width,), or () if they are the same for all values.
    """

    factor: FloatArray
    shift: FloatArray


Step = Linear | Scaling | str
"""A linear step, a scaling, or the name of an activation."""

SIGMOID = (
    Scaling(np.array(0.5), np.array(0.0)),
    "tanh",
    Scaling(np.array(0.5), np.array(0.5)),
)
"""1 / (1 + exp(-x)) = (1 + tanh(x / 2)) / 2, since the runtime has the hyperbolic tangent."""


@dataclass(frozen=True)
class Read:
    """A Read is the result of reading one layer.

    Attributes:
        name: place and type of the layer, for messages.
        steps: its steps; empty if it passes its input on.
        fault: why it cannot be taken; empty if it can.
    """

    name: str
    steps: tuple[Step, ...] = ()
    fault: str = ""


def network_of(
    reads: Sequence[Read], window: Window, scalings: tuple[Affine, Affine], taken: str
) -> FeedForward:
    """Make the feed-forward network that is equal to the layers of a chain.

    The chain takes physical inputs, (n_in * n_inputs,), and gives physical outputs, (n_out *
    n_outputs,), both flattened row by row, time first and the oldest sample first.

    Args:
        reads: the layers in their order.
        window: n_in and n_out.
        scalings: the scalings of inputs and outputs, around the network.
        taken: the layers that can be taken, for messages.

    Raises:
        ValueError: a layer cannot be taken, or its sizes do not fit; there is one line for each.
    """
    inputs, outputs = scalings
    first = Scaling(np.tile(inputs.scale, window.n_in), np.tile(inputs.offset, window.n_in))
    last = Scaling(
        np.tile(1 / outputs.scale, window.n_out),
        np.tile(-outputs.offset / outputs.scale, window.n_out),
    )
    unknown = [f"  {read.name}: {read.fault}" for read in reads if read.fault]
    faults = [*unknown, *_misfits(reads, window, (len(inputs.scale), len(outputs.scale)))]
    if faults:
        remedy = f"\nexpected {taken}" if unknown else ""
        raise ValueError("\n".join(["the network cannot be taken:", *faults]) + remedy)
    steps = (first, *(step for read in reads for step in read.steps), last)
    features = FeatureMap(Differences(len(inputs.scale), 0))
    return FeedForward(_layers(steps), window.n_in, features)


def _misfits(reads: Sequence[Read], window: Window, channels: tuple[int, int]) -> list[str]:
    """Name the layers whose sizes do not fit, or whose weights are not finite.

    The sizes after a layer that cannot be taken are not known.
    """
    (n_inputs, n_outputs), misfits = channels, []
    wanted = window.n_in * n_inputs
    width: int | None = wanted
    expected = f"n_in x inputs = {window.n_in} x {n_inputs} = {wanted}, oldest sample first"
    for read in reads:
        for step in read.steps:
            arrays = () if isinstance(step, str) else tuple(vars(step).values())
            if not all(np.isfinite(array).all() for array in arrays):
                misfits.append(f"  {read.name}: has numbers that are not finite; expected finite")
            if isinstance(step, str) or arrays[0].ndim == 0:
                continue
            takes, gives = arrays[0].shape[-1], arrays[0].shape[0]
            if width not in (None, takes):
                misfits.append(f"  {read.name}: takes {takes} values; expected {expected}")
            width, expected = gives, f"{gives}, which the layer before it gives"
        width = None if read.fault else width
    wanted = window.n_out * n_outputs
    if width not in (None, wanted):
        misfits.append(
            f"  the last layer gives {width} values; expected n_out x outputs = {window.n_out} x "
            f"{n_outputs} = {wanted}, oldest sample first"
        )
    return misfits


def _layers(steps: Iterable[Step]) -> tuple[Layer, ...]:
    """Fold steps into layers; the first and the last step are scalings."""
    layers: list[Layer] = []
    first, *others = steps
    assert isinstance(first, Scaling)
    affine: Linear | Scaling = first
    for step in others:
        if isinstance(step, str):
            layers.append(_layer(affine, step))
            width = len(layers[-1].bias)
            affine = Scaling(np.ones(width), np.zeros(width))
        elif isinstance(affine, Linear) and isinstance(step, Linear):
            layers.append(_layer(affine, "identity"))
            affine = step
        else:
            affine = _joined(affine, step)
    return (*layers, _layer(affine, "identity"))


def _joined(first: Linear | Scaling, then: Linear | Scaling) -> Linear | Scaling:
    """Join two steps into one; at least one of them is a scaling."""
    if isinstance(then, Linear):
        assert isinstance(first, Scaling)
        return Linear(then.weights * first.factor, then.bias + then.weights @ first.shift)
    if isinstance(first, Linear):
        factor = np.broadcast_to(then.factor, first.bias.shape)
        return Linear(factor[:, None] * first.weights, factor * first.bias + then.shift)
    return Scaling(then.factor * first.factor, then.factor * first.shift + then.shift)


def _layer(affine: Linear | Scaling, activation: str) -> Layer:
    """Round a step to single precision and add an activation after it."""
    if isinstance(affine, Scaling):
        affine = Linear(np.diag(affine.factor), affine.shift)
    with np.errstate(over="ignore"):  # the layer then refuses values that are not finite
        return Layer(affine.weights.astype(np.float32), affine.bias.astype(np.float32), activation)
