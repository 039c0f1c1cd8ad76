"""How long work tells how far it is."""

from __future__ import annotations

from collections.abc import Callable

Advance = Callable[[int, int, str], None]
"""Called with the work done, the work to do, and a remark."""

Bar = Callable[[str], Advance]
"""Opens the progress bar of a named stage."""
