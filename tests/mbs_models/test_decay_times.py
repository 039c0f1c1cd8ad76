"""The window that a slider-crank needs: seconds with a stiff drive, a minute with a weak one."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

from slide_fmu.cli.app import app
from slide_fmu.memory import motions

RECIPE = """
name = "crank"
description = "flexible slider-crank, coarse"

[system]
model = "mbs_models.slider_crank:SliderCrank"
parameters = {{ elements = 4, substeps = 4, proportional = {proportional}, differential = 100.0 }}

[window]
step = 0.03125
n_in = 128
n_out = 32
remaining_amplitude = 0.01

[data]
seed = 20263
duration = {duration}
burn_in = 1.0
train = 4
validation = 2

[[data.excitation]]
kind = "speed_ramps"
weight = 1.0
speed = {speed}
acceleration = {acceleration}

[network]
family = "state_space"
order = 4
hidden = 8

[training]
expert.segment = 32
"""
WEAK, STIFF = 10.0, 1000.0
"""P of the drive in N m/rad."""
WEAK_DECAY = 46.05
"""In s: the drive settles with -P / D = -0.1 1/s."""
SLOW: dict[str, float] = {"duration": 8.0, "speed": 1.0, "acceleration": 1.0}
FAST: dict[str, float] = {"duration": 40.0, "speed": 8.0, "acceleration": 20.0}
"""As in the released recipe: at such speeds the weak drive's mode grows for moments."""


def window(
    folder: Path, monkeypatch: pytest.MonkeyPatch, proportional: float, motion: dict[str, float]
) -> tuple[int, str, dict[str, Any]]:
    """Exit code, output in one line and figures of ``slide-fmu window``."""
    monkeypatch.setattr(motions, "MOTIONS", 3)
    recipe, figures = folder / "crank.toml", folder / "figures.json"
    recipe.write_text(RECIPE.format(proportional=proportional, **motion), encoding="utf-8")
    result = CliRunner().invoke(app, ["window", str(recipe), "--json", str(figures)])
    found = json.loads(figures.read_text(encoding="utf-8"))
    return result.exit_code, result.output, found


@pytest.mark.extended
def test_the_window_of_the_paper_is_refused_for_its_weak_drive(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    code, output, figures = window(tmp_path, monkeypatch, WEAK, SLOW)
    assert code == 1
    assert not figures["sufficient"]
    refused = re.search(r"n_in - n_out = 128 - 32 = 96 samples \(3 s\)", output)
    needed = re.search(r"need (\d+) samples \(([\d.]+) s\) to decay: give n_in >= (\d+)", output)
    assert refused is not None
    assert needed is not None
    samples, decay_time, n_in = (float(value) for value in needed.groups())
    assert decay_time == pytest.approx(WEAK_DECAY, rel=0.06)
    assert samples == pytest.approx(decay_time / 0.03125, abs=2)
    assert n_in == samples + 32 == figures["recommended_n_in"]
    assert "window.allow_short = true" in output
    assert figures["decay_time_s"]["mean"] == pytest.approx(WEAK_DECAY, rel=0.02)
    assert figures["measured_decay_time_s"]["worst"] == pytest.approx(WEAK_DECAY, rel=0.1)


@pytest.mark.extended
def test_it_is_refused_at_full_speed_too_though_the_mode_grows_for_moments(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    code, output, figures = window(tmp_path, monkeypatch, WEAK, FAST)
    assert code == 1
    assert "signs of damping" not in output
    assert f"give n_in >= {figures['recommended_n_in']}" in output
    assert "without end" in output
    assert figures["decay_time_s"]["local_worst"] is None
    assert figures["decay_time_s"]["mean"] == pytest.approx(WEAK_DECAY, rel=0.2)
    assert figures["decay_time_s"]["worst"] == pytest.approx(WEAK_DECAY, rel=0.2)
    assert figures["measured_decay_time_s"]["mean"] == pytest.approx(WEAK_DECAY, rel=0.1)


@pytest.mark.extended
def test_the_window_of_the_paper_is_long_enough_for_a_stiff_drive(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    code, _, figures = window(tmp_path, monkeypatch, STIFF, SLOW)
    assert code == 0
    assert figures["sufficient"]
    assert 1.6 < figures["decay_time_s"]["mean"] < figures["decay_time_s"]["worst"] < 1.9
    mean = figures["decay_time_s"]["mean"]
    assert figures["measured_decay_time_s"]["mean"] == pytest.approx(mean, rel=0.1)
