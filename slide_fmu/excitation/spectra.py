"""These kinds of excitation draw every input by its spectrum: sines, their sums, and noise."""

from __future__ import annotations

from typing import Literal

import numpy as np

from slide_fmu.core.signals import FloatArray, Signal, by_axis
from slide_fmu.excitation.base import CountRange, Kind, PositiveRange, Range, require_one_each
from slide_fmu.excitation.channels import ChannelKind
from slide_fmu.excitation.descriptions import between, distance, size, subject


class FilteredRandom(ChannelKind):
    """The input is white noise through a low-pass filter of first order, like a rough road.

    Its RMS is one over a long time, so ``amplitude`` sets the RMS and not the peak.

    Attributes:
        angular_frequency: range in rad/s for the filter's corner frequency; its logarithm is drawn
            uniformly.
    """

    kind: Literal["filtered_random"]
    angular_frequency: PositiveRange

    def described(self, signals: tuple[Signal, ...], step: float) -> str:
        return (
            f"{subject(signals)} is noise through a low-pass filter of "
            f"{between(self.angular_frequency)} rad/s, with an RMS of "
            f"{self.size(signals)}, clipped to its range"
        )

    def signal(self, time: FloatArray, rng: np.random.Generator) -> FloatArray:
        from scipy.signal import lfilter  # slow to import, and not needed to read recipes

        low, high = np.log(self.angular_frequency)
        step = time[1] - time[0] if len(time) > 1 else 0.0
        pole = float(np.exp(-step * np.exp(rng.uniform(low, high))))
        noise = rng.standard_normal(len(time)) * np.sqrt(max(1.0 - pole**2, 0.0))
        # the filter starts in its steady state: the first sample has the RMS of the others
        first = rng.standard_normal() * pole
        return np.asarray(lfilter([1.0], [1.0, -pole], noise, zi=[first])[0])


class Harmonic(ChannelKind):
    """The input is one sine of random phase.

    Attributes:
        angular_frequency: range in rad/s from which the frequency is drawn uniformly.
        decades: whether the logarithm of the frequency is drawn uniformly instead, so that slow
            sines are as frequent as fast ones.
    """

    bends = True

    kind: Literal["harmonic"]
    angular_frequency: PositiveRange
    decades: bool = False

    def described(self, signals: tuple[Signal, ...], step: float) -> str:
        evenly = ", slow ones as often as fast ones," if self.decades else ""
        return (
            f"{subject(signals)} is a lasting sine of {between(self.angular_frequency)} rad/s"
            f"{evenly} with an amplitude of {self.size(signals)}"
        )

    def signal(self, time: FloatArray, rng: np.random.Generator) -> FloatArray:
        low, high = self.angular_frequency
        part = rng.random()
        frequency = low * (high / low) ** part if self.decades else low + (high - low) * part
        return np.asarray(np.sin(frequency * time + rng.uniform(-np.pi, np.pi)))


class Sweep(ChannelKind):
    """The input is a sine whose frequency changes linearly in time, randomly up or down.

    Attributes:
        angular_frequency: range in rad/s that the frequency sweeps through.
        decades: whether the logarithm of the frequency changes linearly instead: the sweep takes
            as long for each octave.
    """

    bends = True

    kind: Literal["sweep"]
    angular_frequency: PositiveRange
    decades: bool = False

    def described(self, signals: tuple[Signal, ...], step: float) -> str:
        low, high = self.angular_frequency
        evenly = "as long through each octave, " if self.decades else ""
        return (
            f"{subject(signals)} is a sine that sweeps from {low:g} to {high:g} rad/s, or back, "
            f"{evenly}with an amplitude of {self.size(signals)}"
        )

    def signal(self, time: FloatArray, rng: np.random.Generator) -> FloatArray:
        first, last = self.angular_frequency[:: 1 if rng.random() < 0.5 else -1]
        span = time[-1] - time[0] + 1e-12  # there may be one sample only
        elapsed = time - time[0]
        if self.decades and first != last:
            rate = np.log(last / first) / span
            turned = first / rate * np.expm1(rate * elapsed)
        else:
            turned = first * elapsed + 0.5 * (last - first) / span * elapsed**2
        return np.asarray(np.sin(rng.uniform(-np.pi, np.pi) + turned))


class Multisine(ChannelKind):
    """The input is a sum of sines of random frequencies and phases.

    Its RMS is one over a long time, so ``amplitude`` sets the RMS and not the peak.

    Attributes:
        angular_frequency: range in rad/s from which all frequencies are drawn uniformly.
        components: range of the number of sines, both ends included.
        decades: whether the range is divided into as many parts of the same ratio as there are
            sines, with one sine in each part: slow and fast sines at once.
        points: range in s of the time between communication points, whose logarithm is drawn
            uniformly. All inputs are straight from point to point, or held if they are held
            inputs, as a master with such a step gives them. Without it, sines bend everywhere.
    """

    kind: Literal["multisine"]
    angular_frequency: PositiveRange
    components: CountRange = (8, 20)
    decades: bool = False
    points: PositiveRange | None = None

    @property
    def bends(self) -> bool:  # type: ignore[override]  # a constant of the other kinds
        """Whether the inputs are curved between samples: not with communication points."""
        return self.points is None

    def check(self, signals: tuple[Signal, ...]) -> None:
        angles = [signal.name for signal in signals if signal.angle is not None]
        if angles and self.points is not None:
            raise ValueError(
                f"points = {list(self.points)} with inputs {angles}, which are cosine and sine of "
                "an angle; expected no points: a straight line leaves the circle. Remove the key"
            )

    def described(self, signals: tuple[Signal, ...], step: float) -> str:
        spread = ", slow and fast ones at once" if self.decades else ""
        several = f"a sum of {between(self.components)} sines"
        sines = "a sine" if self.components == (1, 1) else several
        return (
            f"{subject(signals)} is {sines} of "
            f"{between(self.angular_frequency)} rad/s{spread}, with an RMS of "
            f"{self.size(signals)}, clipped to its range{self._apart(step)}"
        )

    def _apart(self, step: float) -> str:
        if self.points is None:
            return ""
        low, high = (step * _samples(value, step) for value in self.points)
        return f"; it is straight or held between points {between((low, high), 's')} apart"

    def inputs(
        self,
        signals: tuple[Signal, ...],
        time: FloatArray,
        factor: float,
        rng: np.random.Generator,
    ) -> FloatArray:
        if self.points is None or len(time) < 2:
            return super().inputs(signals, time, factor, rng)
        low, high = np.log(self.points)
        step = float(time[1] - time[0])
        apart = _samples(float(np.exp(rng.uniform(low, high))), step)
        points = np.arange(-int(rng.integers(apart)), len(time) + apart, apart)
        drawn = super().inputs(signals, time[0] + step * points, factor, rng)
        at = np.arange(len(time))
        before = np.searchsorted(points, at, side="right") - 1
        return np.stack(
            [
                values[before] if signal.hold == "zero_order" else np.interp(at, points, values)
                for signal, values in zip(signals, drawn.T, strict=True)
            ],
            axis=1,
        )

    def signal(self, time: FloatArray, rng: np.random.Generator) -> FloatArray:
        count = int(rng.integers(self.components[0], self.components[1] + 1))
        if self.decades:
            low, high = np.log(self.angular_frequency)
            frequency = np.exp(low + (high - low) * (np.arange(count) + rng.random(count)) / count)
        else:
            frequency = rng.uniform(*self.angular_frequency, count)
        phase = rng.uniform(-np.pi, np.pi, count)
        total = np.sin(time[:, None] * frequency + phase).sum(axis=1)
        return np.asarray(total * np.sqrt(2 / count))


class BandSines(Kind):
    """Every input is a sum of lasting sines in a band of its own.

    Attributes:
        bands: ranges in rad/s, one for each input, from which frequencies are drawn uniformly. Of
            an angle that is given by cosine and sine, that of the cosine counts.
        components: range of the number of sines, both ends included. A sum of several has the RMS
            of a single one, and is clipped to the range.
        amplitude: range of the amplitude of a single sine, as a part of half the range of the
            input; it is drawn uniformly, separately for each input.
        offset: range of a constant of random sign that is added, likewise.
    """

    bends = True

    kind: Literal["band_sines"]
    bands: tuple[PositiveRange, ...]
    components: CountRange = (1, 1)
    amplitude: Range = (1.0, 1.0)
    offset: Range = (0.0, 0.0)

    @property
    def angular_frequency(self) -> tuple[float, float]:
        """The lowest and the highest frequency of all bands in rad/s."""
        return min(low for low, _ in self.bands), max(high for _, high in self.bands)

    def check(self, signals: tuple[Signal, ...]) -> None:
        require_one_each(self.kind, "bands", self.bands, signals)

    def described(self, signals: tuple[Signal, ...], step: float) -> str:
        bands = ", ".join(
            f"{signal.name} {between(band)}"
            for signal, band in zip(signals, self.bands, strict=True)
            if signal.angle != "sine"
        )
        sines = "a sine" if self.components == (1, 1) else f"{between(self.components)} sines"
        about = f", about an offset of {distance(self.offset, signals)}" if self.offset[1] else ""
        return (
            f"{subject(signals)} is {sines} in a band of its own in rad/s ({bands}) with an "
            f"amplitude of {size(self.amplitude, signals)}{about}"
        )

    def inputs(
        self,
        signals: tuple[Signal, ...],
        time: FloatArray,
        factor: float,
        rng: np.random.Generator,
    ) -> FloatArray:
        own = [b for s, b in zip(signals, self.bands, strict=True) if s.angle != "sine"]
        drawn = [
            self.in_band(band).inputs(axis, time, factor, rng)
            for axis, band in zip(by_axis(signals), own, strict=True)
        ]
        return np.concatenate(drawn, axis=1)

    def in_band(self, band: tuple[float, float]) -> Multisine:
        """Return the sum in a band; the RMS of a sine is its amplitude over the root of 2."""
        low, high = self.amplitude
        return Multisine(
            kind="multisine",
            weight=self.weight,
            angular_frequency=band,
            components=self.components,
            amplitude=(low / 2**0.5, high / 2**0.5),
            offset=self.offset,
        )


def _samples(time: float, step: float) -> int:
    """Return the number of sample steps in a time, at least 1."""
    return max(1, round(time / step))
