"""What a network sees of the inputs: one set of features in each module, with its derivative.

No network is known here, only signals: features are pure functions of the newest inputs.
"""
