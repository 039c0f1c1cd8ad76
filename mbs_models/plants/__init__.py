"""The models share what is here: solvers, systems on a plant, spring masses, drives, checks."""
