"""Run the scripts of the gallery and keep what they print and draw, for the site.

    python docs/gallery_results.py [NAME ...]

The site is built often, also by a test, and where the repository was just checked out; trainings
of minutes have no place there. So their results are kept in docs/tutorials/results, as the
pictures of released FMUs are kept beside these. Without names all scripts are run.
"""

from __future__ import annotations

import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).parents[1]
GALLERY, RESULTS = ROOT / "docs" / "gallery", ROOT / "docs" / "tutorials" / "results"
PICTURE = "picture: "
"""What stands before the path of its picture in a script's last line."""


def run(name: str, folder: Path) -> list[str]:
    """Run a script in a folder that looks like the root of a checkout; give the lines it prints.

    Raises:
        subprocess.CalledProcessError: the script failed.
    """
    for part in ("docs", "fmus"):
        (folder / part).symlink_to(ROOT / part)
    command = [sys.executable, f"docs/gallery/{name}.py"]
    done = subprocess.run(command, cwd=folder, stdout=subprocess.PIPE, text=True, check=True)
    return done.stdout.splitlines()


def keep(name: str) -> None:
    """Run a script, and write what its page shows: its lines, and its picture below them."""
    with tempfile.TemporaryDirectory() as place:
        *lines, last = run(name, Path(place))
        RESULTS.mkdir(exist_ok=True)
        shutil.copy(Path(place, last.removeprefix(PICTURE)), RESULTS / f"{name}.png")
    text = "\n".join(["```", *lines, "```", "", f"![model and surrogate](../results/{name}.png)"])
    (RESULTS / f"{name}.md").write_text(f"{text}\n", encoding="utf-8")


if __name__ == "__main__":
    for name in sys.argv[1:] or sorted(path.stem for path in GALLERY.glob("*.py")):
        print(name, flush=True)
        keep(name)
