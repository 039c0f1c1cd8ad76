"""This room finds how long a system and its surrogate remember: modes, decay, stability.

``modes`` gives the eigenvalues of a linearized system. ``decay`` gives the time in which initial
effects vanish along a motion, and ``convergence`` measures it. ``sizing`` finds the window that a
recipe needs. ``stability`` tests whether a recursive network forgets its state and stays bounded.
Nothing is trained here.
"""
