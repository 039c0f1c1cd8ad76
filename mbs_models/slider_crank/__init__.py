"""A slider-crank with a flexible rod, whose crank is driven to a desired angle."""

from mbs_models.slider_crank.slider_crank import SliderCrank

__all__ = ["SliderCrank"]
