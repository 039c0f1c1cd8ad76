"""Models as a user would bring them: FMUs, built where the tests run."""
