"""A number without dimension has no printed unit."""

from __future__ import annotations

import pytest

from slide_fmu.core.signals import Signal
from slide_fmu.core.units import behind, labelled, ratio, require_unit
from slide_fmu.excitation.descriptions import listed
from tests.refusals import refused


def test_number_without_dimension_has_no_printed_unit() -> None:
    assert (behind("1"), behind("N")) == ("", " N")
    assert (labelled("level", "1"), labelled("force", "N")) == ("level", "force / N")
    assert labelled("distance", "m", " in ") == "distance in m"
    assert (ratio("m", "1"), ratio("m", "N"), ratio("m", "N/s")) == ("m", "m/N", "m/(N/s)")


def test_error_messages_of_signals_without_dimension_have_no_unit() -> None:
    signal = Signal("share", "1", 0.0, 1.0)
    assert listed((2.0,), (signal,), "s") == "2 1/s"
    with refused(ValueError, "range [2.0, 1.0]"):
        Signal("share", "1", 2.0, 1.0)


def test_a_unit_that_is_refused_is_not_its_own_remedy() -> None:
    with pytest.raises(ValueError, match=r"'Nm' is none: write 'N.m', or '1'"):
        require_unit("torque", "Nm")
