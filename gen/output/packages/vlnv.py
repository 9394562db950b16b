"""The name of a packaged core among all others: vendor, library, name and version, as FuseSoC and IP-XACT want it."""

from __future__ import annotations

import re
from dataclasses import dataclass

from sosmith.model.errors import SpecificationError

_PART = re.compile(r"[A-Za-z][A-Za-z0-9_.-]*")
_VERSION = re.compile(r"[0-9][A-Za-z0-9_.-]*")


@dataclass(frozen=True, kw_only=True)
class Vlnv:
    """Vendor, library, name and version of a core."""

    vendor: str
    library: str
    name: str
    version: str

    @classmethod
    def read(cls, text: str) -> Vlnv:
        """Return what a text ``vendor:library:name:version`` says.

        Raises
        ------
        SpecificationError
            If it is not of that form: three words that begin with a letter, and a version that begins with a digit,
            all of letters, digits, ``_``, ``.`` and ``-``.
        """
        parts = text.split(":")
        good = len(parts) == 4 and all(map(_PART.fullmatch, parts[:3])) and _VERSION.fullmatch(parts[3])
        if not good:
            raise SpecificationError(
                "the vlnv must be vendor:library:name:version, such as example.org:filters:smooth:1.0, not " + text
            )
        vendor, library, name, version = parts
        return cls(vendor=vendor, library=library, name=name, version=version)

    @classmethod
    def default(cls, name: str) -> Vlnv:
        """Return that of the core `name` where nothing else is asked for."""
        return cls(vendor="user", library="sosmith", name=name, version="1.0")

    def __str__(self) -> str:
        """Return ``vendor:library:name:version``."""
        return f"{self.vendor}:{self.library}:{self.name}:{self.version}"
