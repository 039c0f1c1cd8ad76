"""The slider-crank has a flexible rod; a drive turns its crank to a desired angle."""

from mbs_models.slider_crank.slider_crank import SliderCrank

__all__ = ["SliderCrank"]
