"""This room proposes a recipe for a model or a record, and tries it: ``init``, ``try``.

It simulates the system, proposes a recipe and names its assumptions. A recipe is run in
``pipeline``; nothing is trained or exported here.
"""
