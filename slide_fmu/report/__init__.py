"""This room shows what was found: reports, model cards, tables, charts and words.

Everything here is made from figures that other rooms have found. Nothing is measured here, and
nothing is trained.
"""
