"""Files that every FMU carries: the licences of its libraries, and an icon."""
