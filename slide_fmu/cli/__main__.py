"""``python -m slide_fmu.cli``."""

from slide_fmu.cli import main

if __name__ == "__main__":
    main()
