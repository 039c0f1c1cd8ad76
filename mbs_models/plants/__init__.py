"""The models share what is here: rows of masses and springs, driven plants, and checks of
parameters."""
