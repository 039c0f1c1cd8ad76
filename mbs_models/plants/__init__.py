"""The models share what is here: exudyn solvers, systems on a plant, drives, parameter checks."""
