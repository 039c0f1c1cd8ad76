"""What the models share: exudyn solvers, systems over a plant, drives, checks of parameters."""
