"""This package has the reference systems: multibody models in exudyn, one folder per machine.

Each folder's ``__init__`` offers the system's class under the name that recipes use. ``plants``
holds what models share: solvers, stepping, set points. ``pictures`` draws models for people; no
model imports it.
"""
