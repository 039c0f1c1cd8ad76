"""This table lists the questions that records answer otherwise than a simulated system."""

from __future__ import annotations

from types import MappingProxyType
from typing import Final

_OWN: dict[str, dict[str, str]] = {
    "data.model_answers": {"identity": "answers:identity"},
    "data.generation": {"make_missing": "answers:cut_missing"},
    "data.unseen": {"known_or_simulated": "answers:unseen_motions"},
    "data.workplace": {"require_work_elsewhere": "answers:require_work_elsewhere"},
    "memory.stability": {
        "excited_inputs": "answers:excited_inputs",
        "tested_corners": "answers:tested_corners",
    },
    "pipeline.case_checks": {"check_systems": "answers:check_records"},
    "validation.data_origin": {
        "origin_of_data": "origin:record_origin",
        "require_same_origin": "origin:require_same_records",
    },
    "pipeline.numbers": {
        "found_numbers": "answers:found_numbers",
        "least_numbers": "answers:least_numbers",
    },
    "pipeline.resolved": {"lengths_of_case": "sizing:lengths_of_case"},
    "report.run_report": {
        "affine_response": "answers:no_response",
        "remarks_on_data": "remarks:remarks_on_records",
    },
    "pipeline.stages": {
        "size_case": "sizing:size_case",
        "step_of_case": "answers:no_remark_on_step",
    },
    "propose.trial": {"tried_motions": "answers:tried_records"},
    "validation.measure": {"further_rows": "answers:no_further_rows"},
    "validation.validate": {"validate_against": "validation:validate_records"},
}
"""Questions by the module that asks them, each with the module here and the function that answers
it."""

ANSWERS: Final = MappingProxyType(
    {
        f"slide_fmu.{module}:{question}": f"slide_fmu.records.{place}"
        for module, questions in _OWN.items()
        for question, place in questions.items()
    }
)
"""The same with whole names, as ``slide_fmu.data.answers`` looks them up."""
