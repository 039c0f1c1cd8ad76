"""How long a system and its surrogate remember: modes, decay, window sizing, stability.

Here the eigenvalues decide how long the window must be. Nothing is trained here.
"""
