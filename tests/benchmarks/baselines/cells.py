"""State-space networks in torch."""

from __future__ import annotations

from typing import Any

from baselines import BaselineError
from slide_fmu.features.differences import Differences
from slide_fmu.features.feature_map import FeatureMap
from slide_fmu.network.state_space.cell import Roles
from slide_fmu.network.state_space.network import StateSpace


def _order(features: FeatureMap) -> int:
    """Order of the differences that are all the features, in their order and not centred.

    Raises:
        BaselineError: they are something else.
    """
    found, every = features.features, tuple(range(features.features.n_signals))
    as_they_are = features.chosen == every and not features.scaling.offset.any()
    if not isinstance(found, Differences) or not as_they_are:
        raise BaselineError("torch: other features than differences of the inputs")
    return found.order


class TorchCells:
    """A plain cell by ping-pong, as StateSpace.ping_pong, in torch.

    Raises:
        ImportError: torch is not installed.
        BaselineError: gated cells, or features of other kinds or in several roles.
    """

    def __init__(self, network: StateSpace) -> None:
        import torch

        torch.set_num_threads(1)
        self.torch = torch
        cell, every = network.cell, tuple(range(network.features.n_signals))
        if cell.gated or network.roles != Roles(every, every):
            raise BaselineError("torch: gated cells, or features in several roles")
        self.network, self.n = network, len(cell.a)
        self.w, self.c, self.d0 = (torch.from_numpy(m.T.copy()) for m in (cell.w, cell.c, cell.d0))
        joined = [torch.from_numpy(m) for m in (cell.a, cell.b, torch.zeros(self.n, 1).numpy())]
        self.ab = torch.cat(joined, 1).T.contiguous()
        self.e, self.d = torch.from_numpy(cell.e.T.copy()), torch.from_numpy(cell.d.T.copy())
        self.act = torch.tanh if cell.activation == "tanh" else lambda v: v * v * v
        self.z = torch.zeros(2, self.n + cell.b.shape[1] + 1)
        self.z[:, -1] = 1
        self.order = _order(network.features)
        self.scale = torch.from_numpy(network.features.scaling.scale)
        self.recent = torch.zeros(3, network.n_channels, dtype=torch.float64)
        self.fade, self.age = network.fade().tolist(), 0

    def step(self, row: Any) -> object:
        """One sample of scaled inputs, shape (n_channels,); the values."""
        torch = self.torch
        self.recent = torch.roll(self.recent, -1, 0)
        self.recent[-1] = torch.from_numpy(row)
        blocks = [torch.diff(self.recent, k, 0)[-1] for k in range(self.order + 1)]
        features = (torch.cat(blocks) / self.scale).float()
        z, n = self.z, self.n
        z[:, n:-1] = features
        z[:, :n] = z @ self.ab + self.act(z @ self.w) @ self.e
        older, younger = z[:, :n] @ self.c + features @ self.d + self.d0
        values = older + self.fade[self.age] * (younger - older)
        self.age += 1
        if self.age == self.network.n_samples:
            z[0, :n], z[1, :n], self.age = z[1, :n].clone(), 0, 0
        return values.numpy()
