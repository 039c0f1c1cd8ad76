"""This package has the reference systems: multibody models in exudyn, one folder per machine.

Each folder's ``__init__`` offers the system's class under the name that recipes use. ``plants``
has what models share in addition to ``slide_fmu.systems.exudyn``, which integrates them: rows of
masses, checks of parameters. ``pictures`` draws models for users; no model imports it.
"""
