"""FMUs that carry a scripted or exported torch module and need Python where they run."""
