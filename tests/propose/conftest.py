"""Fixture: proposals in a fraction of their time."""

from __future__ import annotations

import pytest

from slide_fmu.propose import first_look, lasting_tones


@pytest.fixture
def brief(monkeypatch: pytest.MonkeyPatch) -> None:
    """Models are simulated for a short time, and their gains are measured at few frequencies."""
    monkeypatch.setattr(first_look, "SAMPLES", 200)
    monkeypatch.setattr(lasting_tones, "LINES", 256)
