"""Every FMU carries these files: the licences of its libraries, and an icon."""
