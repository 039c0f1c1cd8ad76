"""A recipe's network is compared with models of other kinds that learn from the same data.

All get the same time to learn (``baselines``), and a table shows their errors, sizes and times.
"""
