"""Windows are cut from trajectories on the fly, at every phase, on the training device."""

from __future__ import annotations

from dataclasses import dataclass

import torch

from slide_fmu.core.window import Window


@dataclass(frozen=True, eq=False)
class WindowData:
    """WindowData are the trajectories of one split, from which windows are cut.

    Windows are numbered from 0: first all phases of the first trajectory, then those of the next.

    Attributes:
        inputs: features of the inputs, shape (n_trajectories, N, n_features).
        targets: scaled targets, shape (n_trajectories, N + 1, n_targets).
        window: determines which inputs and targets belong together (the index law).

    Raises:
        ValueError: the trajectories are shorter than a window.
    """

    inputs: torch.Tensor
    targets: torch.Tensor
    window: Window

    def __post_init__(self) -> None:
        for name in ("inputs", "targets"):  # otherwise every cut would copy all of them
            object.__setattr__(self, name, getattr(self, name).contiguous())
        if self.inputs.shape[1] < self.window.n_in:
            raise ValueError(
                f"trajectories of {self.inputs.shape[1]} samples; expected at least n_in = "
                f"{self.window.n_in}; make data.duration longer"
            )

    @property
    def n_windows(self) -> int:
        """The number of windows: all phases of all trajectories."""
        return len(self.inputs) * (self.inputs.shape[1] - self.window.n_in + 1)

    def cut(self, numbers: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
        """Cut windows by their numbers, shape (B,), each in 0 .. n_windows - 1.

        The result is features (B, n_in, n_features) and targets (B, n_out * n_targets), sample by
        sample.
        """
        per_trajectory = self.inputs.shape[1] - self.window.n_in + 1
        trajectory, start = numbers // per_trajectory, numbers % per_trajectory
        inputs = _cut(self.inputs, trajectory, start, self.window.n_in)
        first = start + self.window.n_truncated + 1
        return inputs, _cut(self.targets, trajectory, first, self.window.n_out).flatten(1)

    def evenly_chosen(self, count: int) -> torch.Tensor:
        """Return the numbers of at least ``count`` windows in equal distances over all of them.

        All windows are chosen if there are fewer.
        """
        stride = max(1, self.n_windows // count)
        return torch.arange(0, self.n_windows, stride, device=self.inputs.device)


def _cut(
    values: torch.Tensor, trajectory: torch.Tensor, first: torch.Tensor, length: int
) -> torch.Tensor:
    """Cut parts of a length, (B, length, channels), out of trajectories.

    Trajectory and first sample of each part have the shape (B,). All parts are rows of one strided
    view of the memory, so that a selection is one copy. Rows that run across the end of a
    trajectory exist in the view, but are never taken.
    """
    n_trajectories, samples, channels = values.shape
    flat = values.view(-1)
    count = n_trajectories * samples - length + 1
    views = flat.as_strided((count, length * channels), (channels, 1))
    return views.index_select(0, trajectory * samples + first).view(-1, length, channels)
