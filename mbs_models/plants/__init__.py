"""The models share what is here: rows of masses and springs, and checks of parameters."""
