"""Everything that turns a surrogate into an FMU."""
