"""These systems have one mass: linear, Duffing, and a Duffing oscillator on a moving base."""

from mbs_models.oscillators.oscillators import (
    DuffingBaseMotion,
    DuffingOscillator,
    LinearOscillator,
)

__all__ = ["DuffingBaseMotion", "DuffingOscillator", "LinearOscillator"]
