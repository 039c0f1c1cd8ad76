"""This room begins with a model or a record that has no recipe yet: ``init``, ``try``.

It looks at the system, proposes a recipe and says what was assumed. A recipe is run in
``pipeline``; nothing is trained or exported here.
"""
