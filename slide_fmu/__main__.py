"""``python -m slide_fmu`` does what the console script ``slide-fmu`` does."""

from slide_fmu.cli import main

if __name__ == "__main__":
    main()
