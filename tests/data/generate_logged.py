"""Generate a recipe's data with the process pool; a program that tests can kill.

Usage: generate_logged.py RECIPE.json FOLDER WORKERS
"""

from __future__ import annotations

import sys
from pathlib import Path

from slide_fmu.data.generation import generate
from slide_fmu.data.pool import process_pool
from slide_fmu.recipe.case import case_of
from slide_fmu.recipe.recipe import Recipe
from tests.progress import silent

if __name__ == "__main__":
    recipe = Recipe.model_validate_json(Path(sys.argv[1]).read_text(encoding="utf-8"))
    with process_pool(int(sys.argv[3])) as pool:
        generate(case_of(recipe), Path(sys.argv[2]), pool, silent)
