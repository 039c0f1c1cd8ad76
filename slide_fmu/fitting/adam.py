"""Adam with decoupled weight decay, as in ``torch.optim.AdamW``, whose first use takes seconds.

An optimizer of torch imports torch's compiler, which this program never uses: in a training of
seconds that is a large part of the time.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Any, final

import torch

FIRST, SECOND = 0.9, 0.999
"""How slowly the means of gradients and of their squares change (Kingma and Ba, 2015)."""


@final
class AdamW:
    """AdamW moves parameters against means of their gradients (Loshchilov and Hutter, 2019).

    Without weight decay it is Adam.
    """

    def __init__(
        self,
        parameters: Iterable[torch.Tensor],
        *,
        weight_decay: float = 0.0,
        epsilon: float = 1e-8,
    ) -> None:
        """Take the parameters; a step leaves those that have no gradient.

        Args:
            parameters: tensors that are changed in place.
            weight_decay: what a step takes of every weight, in parts of it, per learning rate.
            epsilon: guard of the denominator.
        """
        self.parameters = list(parameters)
        self.weight_decay, self.epsilon, self.steps = weight_decay, epsilon, 0
        self.means = [torch.zeros_like(parameter) for parameter in self.parameters]
        self.squares = [torch.zeros_like(parameter) for parameter in self.parameters]

    def forget_gradients(self) -> None:
        """Remove the gradients of all parameters, which the next backward pass makes anew."""
        for parameter in self.parameters:
            parameter.grad = None

    @torch.no_grad()
    def step(self, rate: float) -> None:
        """Change all parameters by one step at a learning rate."""
        self.steps += 1
        length = rate / (1 - FIRST**self.steps)
        spread = math.sqrt(1 - SECOND**self.steps)
        for parameter, mean, square in zip(self.parameters, self.means, self.squares, strict=True):
            gradient = parameter.grad
            if gradient is None:
                continue
            parameter.mul_(1 - rate * self.weight_decay)
            mean.lerp_(gradient, 1 - FIRST)
            square.mul_(SECOND).addcmul_(gradient, gradient, value=1 - SECOND)
            guarded = square.sqrt().div_(spread).add_(self.epsilon)
            parameter.addcdiv_(mean, guarded, value=-length)

    def state_dict(self) -> dict[str, Any]:
        """Return what the next steps depend on beside the parameters."""
        return {"steps": self.steps, "means": self.means, "squares": self.squares}

    def load_state_dict(self, state: dict[str, Any]) -> None:
        """Go on from a state.

        Raises:
            KeyError, ValueError, RuntimeError: the state is of something else.
        """
        for own, kept in ((self.means, state["means"]), (self.squares, state["squares"])):
            for tensor, saved in zip(own, kept, strict=True):
                tensor.copy_(saved)
        self.steps = int(state["steps"])
