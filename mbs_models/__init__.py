"""Reference systems built with exudyn; recipes name them as ``"mbs_models.oscillators:Class"``."""
