"""Credentials are files in an FMU that state its purpose and validity, and how to check them.

They lie under ``extra/``, which other tools may change: the runtime does not read them, and the
identity of the FMU does not depend on them. Formats are SRMD 1.0.0 (resource metadata of SSP
Traceability) and FMI-LS-REF 1.0.0-alpha.1 (related files and experiments).
"""
