"""``python -m slide_fmu`` does what the console script ``slide-fmu`` does.

Python begins its search path with the current folder then, where a user's ``attr.py`` or
``numpy.py`` would take the place of a package that is needed here. So that folder goes to the end.
"""

import sys
from pathlib import Path

HERE = Path.cwd()

if sys.path and sys.path[0] == str(HERE) and Path(__file__).resolve().parents[1] != HERE:
    sys.path.append(sys.path.pop(0))

from slide_fmu.cli import main  # noqa: E402

if __name__ == "__main__":
    main()
