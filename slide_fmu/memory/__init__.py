"""This room finds how long a system and its surrogate remember: modes, decay, stability.

Here the eigenvalues decide how long the window must be. Nothing is trained here.
"""
