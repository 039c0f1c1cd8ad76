"""Credentials have these names and places in an FMU."""

from __future__ import annotations

import posixpath

METADATA = "extra/org.ssp-standard.ssp-traceability.srmd/resourceMetaData.srmd"
REFERENCES = "extra/org.fmi-standard.fmi-ls-ref"
MANIFEST = f"{REFERENCES}/fmi-ls-manifest.xml"
EXPERIMENTS = f"{REFERENCES}/experiments.exp"
INPUTS = f"{REFERENCES}/inputs.csv"
RESULTS = f"{REFERENCES}/results.csv"
REFERENCE_MODEL = f"{REFERENCES}/reference_model.csv"
PARAMETERS = f"{REFERENCES}/parameters.ssv"

REFERENCES_PAGE = "documentation/fmi-ls-ref.html"
"""FMI-LS-REF recommends to explain what its files are on a page of this name."""

SRMD = "application/x-srmd-meta-data"
EXPERIMENTS_TYPE = "application/x-ma-hs-experiments"
CSV = "text/csv"
SSV = "application/x-ssp-parameter-set"
"""MIME types."""

CLASSIFICATION = "io.github.slide-fmu.credentials"
"""Our own vocabulary, which SRMD requires, in reverse domain notation: no standard vocabulary has
ranges of validity and errors of surrogates."""


def link(target: str, origin: str) -> str:
    """Return the relative address of a member of an FMU for use in another member."""
    return posixpath.relpath(target, posixpath.dirname(origin))


def member(address: str, origin: str) -> str:
    """Return the member that a relative address in another member names; inverse of ``link``."""
    return posixpath.normpath(posixpath.join(posixpath.dirname(origin), address))
