"""The model card describes a released FMU on one screen: verdict, picture and table of errors.

All else stands in the report, which the FMU carries too.
"""

from __future__ import annotations

from slide_fmu.report.error_tables import noise_sentences
from slide_fmu.report.fmu_description import FmuDescription
from slide_fmu.report.limits import useless_beyond
from slide_fmu.report.prose import plain, rendered
from slide_fmu.report.row_tables import card_table, explanations
from slide_fmu.report.speed import timing_text
from slide_fmu.report.table import ReportTable
from slide_fmu.report.tone_map import tone_table
from slide_fmu.validation.error_figures import Timing


def model_card(
    described: FmuDescription,
    picture: str | None = None,
    mechanism: str | None = None,
    timing: Timing | None = None,
) -> str:
    """Write the model card as Markdown.

    Args:
        described: a measured FMU.
        picture: file name of the picture "error against communication step" in the folder of the
            card; None where that was not measured.
        mechanism: file name of a picture of the system, in the same folder; None without one.
        timing: times of a run; None on the card in the FMU, which is the same file in each run.
    """
    measured = described.measured
    assert measured is not None
    quick = [] if described.quick is None else [described.quick]
    return rendered(
        "card.md",
        surrogate=described.surrogate,
        description=described.origin.description,
        measured=measured,
        verdict=described.verdict,
        table=_plain_table(card_table(measured.rows)),
        tones=_plain_table(tone_table(measured.rows)),
        words=explanations(measured.rows, described.surrogate.hold),
        timing=None if timing is None else timing_text(timing),
        useless=useless_beyond(measured),
        remarks=[
            *quick,
            *noise_sentences(measured.in_range.outputs),
            *(measured.remarks if measured.record_remarks is not None else ()),
        ],
        picture=picture,
        mechanism=mechanism,
    )


def _plain_table(table: ReportTable) -> ReportTable:
    """Return a table whose cells Markdown shows as they are."""
    return ReportTable.of(table.heading, (map(plain, row) for row in table.rows), table.title)
