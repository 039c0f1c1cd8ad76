"""The models share these parts: rows of masses, driven plants, and checks of parameters."""
