"""Pictures of the machines in motion, for people. Models do not import them; recipes name them."""
