"""This package draws the machines in motion; recipes name its functions, no model imports it."""
