"""What the site's build does in addition to its plugins."""

from __future__ import annotations

import logging
import re
from pathlib import Path

from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.files import File, Files
from mkdocs.structure.pages import Page
from site_mathml import with_formulas

from slide_fmu.apps.motion.page_moves import solved_moves
from slide_fmu.apps.page.page import drop_page, page_of
from slide_fmu.core.figures import plain

SPACES = "Example file name(s) with space(s) found"
"""mkdocs-gallery warns so of whole paths, also where only the folder of the checkout has a space,
which breaks no link of the site: its links begin in ``docs``."""

GALLERY = re.compile(r"\]\(gallery/(\w+)\.(?:py|md)")
"""Begins a link to a tutorial."""

CARD = re.compile(r'(<a class="reference internal" href="\w+)"')
"""A card of the gallery names a page without its ending, which no file has."""

ROOT = Path(__file__).parents[1]
ROBOT = ROOT / "fmus" / "robot_6r" / "robot_6r.fmu"
TASK = ROOT / "docs" / "tutorials" / "pick_and_place.toml"
DRAWING = "mbs_models.pictures.page_drawings:robot"
ROBOT_PAGE = "robot_page.html"
"""The front page shows this one in a frame."""
DROP_PAGE = "drop.html"
"""Users drop their own FMUs on this one."""


def on_config(config: MkDocsConfig) -> MkDocsConfig:
    """Leave out a warning that is none: the build counts warnings as errors."""
    logging.getLogger("mkdocs.plugins.mkdocs-gallery").addFilter(_is_about_the_site)
    return config


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Add the pages of the robot and of any FMU, which stand in no files."""
    title = "A robot on a flexible socket"
    page = page_of(ROBOT, title, DRAWING, plain(solved_moves(ROBOT, TASK)), "front")
    files.append(File.generated(config, ROBOT_PAGE, content=page))
    files.append(File.generated(config, DROP_PAGE, content=drop_page()))
    return files


def on_page_markdown(markdown: str, page: Page, config: MkDocsConfig, files: Files) -> str:
    """Lead to the pages of tutorials; in a clone, the same links lead to their scripts."""
    return GALLERY.sub(r"](tutorials/pages/\1.md", markdown).replace(
        "pages/README.md", "pages/index.md"
    )


def on_page_content(html: str, page: Page, config: MkDocsConfig, files: Files) -> str:
    """Typeset formulas, keep options of commands on one line, and mend links of the gallery."""
    html = with_formulas(html).replace("<code>--", '<code class="option">--')
    return CARD.sub(r'\1.html"', html)


def on_post_page(output: str, page: Page, config: MkDocsConfig) -> str:
    """Leave the link to the repository a plain one: a theme that counts stars uses the network."""
    return output.replace(' data-md-component="source"', "")


def on_post_template(output_content: str, template_name: str, config: MkDocsConfig) -> str:
    """Do the same on the page of links that lead nowhere, which is no page of the site."""
    return output_content.replace(' data-md-component="source"', "")


def on_post_build(config: MkDocsConfig) -> None:
    """Write the index of the search as a script too, which pages opened from disk may read."""
    index = Path(config.site_dir) / "search" / "search_index.json"
    script = f"var __index = {index.read_text(encoding='utf-8')};\n"
    index.with_suffix(".js").write_text(script, encoding="utf-8")


def _is_about_the_site(record: logging.LogRecord) -> bool:
    return not record.getMessage().startswith(SPACES)
