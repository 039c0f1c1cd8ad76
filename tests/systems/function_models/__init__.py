"""Models of the kind "function" that tests read as files of a user."""
