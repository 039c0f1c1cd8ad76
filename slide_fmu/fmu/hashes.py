"""Every FMU carries a list with the SHA-256 hashes of its other members.

The list has the format of ``sha256sum``: in the folder of an unpacked FMU, ``sha256sum -c`` reads
it, without slide-fmu. It detects damage and single edits. It is not a signature: whoever changes a
member on purpose can change the list too.
"""

from __future__ import annotations

import hashlib
from collections.abc import Mapping

HASHES = "extra/io.github.slide-fmu.hashes/SHA256SUMS"
"""The folder has a name in reverse domain notation, as FMI 3.0 requires (section 2.5)."""


def hash_list(members: Mapping[str, bytes]) -> bytes:
    """Return the list for members of an FMU, by name, sorted."""
    lines = [f"{hashlib.sha256(members[name]).hexdigest()}  {name}\n" for name in sorted(members)]
    return "".join(lines).encode("utf-8")
