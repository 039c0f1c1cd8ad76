"""Credentials are files in an FMU that say what it is good for, and let anybody see it himself.

They lie under ``extra/``, which others may change: no runtime reads them, and the identity of the
FMU does not depend on them. Formats are SRMD 1.0.0 (resource metadata of SSP Traceability) and
FMI-LS-REF 1.0.0-alpha.1 (related files and experiments).
"""
