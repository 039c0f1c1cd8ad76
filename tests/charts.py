"""What charts and reports hold, read back from plain values and from pages."""

from __future__ import annotations

import base64
import gzip
import json
import re
from collections.abc import Sequence
from typing import Any

from slide_fmu.core.web.charts import Chart, Line, Panel


def charts_of(page: str) -> dict[str, Any]:
    """Return the charts that a report holds, and their columns."""
    (text,) = re.findall(r'<script type="text/plain" id="blob-charts">(.*?)</script>', page)
    return dict(json.loads(gzip.decompress(base64.b64decode(text))))


def panel_of(chart: Chart, title: str) -> Panel:
    """Return the panel of a chart with a title."""
    (match,) = [panel for panel in chart.panels if panel.title == title]
    return match


def line_of(lines: Sequence[Line], name: str) -> Line:
    """Return the line with a name."""
    (match,) = [line for line in lines if line.name == name]
    return match
