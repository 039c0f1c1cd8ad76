"""An FMU becomes a page: one HTML file with its surrogate, which runs in any browser."""
