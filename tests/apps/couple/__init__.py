"""Tests of coupled runs: a quarter car cut in two, and released FMUs."""
