"""A flexible boom turns about its foot; a hydraulic cylinder lifts it."""
