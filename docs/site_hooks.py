"""What the site's build does beside its plugins."""

from __future__ import annotations

import logging

from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.files import File, Files
from recipe_page import recipe_page

SPACES = "Example file name(s) with space(s) found"
"""mkdocs-gallery warns so of whole paths, also where only the folder of the checkout has a space,
which breaks no link of the site: its links begin in ``docs``."""


def on_config(config: MkDocsConfig) -> MkDocsConfig:
    """Leave out a warning that is none: the build counts warnings as errors."""
    logging.getLogger("mkdocs.plugins.mkdocs-gallery").addFilter(_is_about_the_site)
    return config


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Add the page of all keys of a recipe, which stands in no file."""
    files.append(File.generated(config, "recipe.md", content=recipe_page()))
    return files


def _is_about_the_site(record: logging.LogRecord) -> bool:
    return not record.getMessage().startswith(SPACES)
