"""Machines that are cut in two: a half, its partner, and the whole machine as truth."""
