"""Writes a bill of materials in CycloneDX: each package that sosmith takes at run time, with its version and hashes.

python requirements/bill.py dist/sosmith.cdx.json

It is made of `base.txt` and `boards.txt` beside it, in the environment of `audit.txt`. The same files give the
same bytes.
"""

import re
import sys
from collections.abc import Iterator
from pathlib import Path

from cyclonedx.model import HashAlgorithm, HashType
from cyclonedx.model.bom import Bom
from cyclonedx.model.component import Component, ComponentType
from cyclonedx.model.license import LicenseExpression
from cyclonedx.output.json import JsonV1Dot6
from packageurl import PackageURL

ROOT = Path(__file__).resolve().parent.parent
LEVELS = ("base", "boards")
_PACKAGE = re.compile(r"^([a-z0-9][a-z0-9.-]*)==([^ ;\\]+)(?P<rest>(?:.|\n(?=\s))*)", re.MULTILINE)


def components(text: str) -> Iterator[Component]:
    """Yield the packages of a file of requirements with hashes."""
    for found in _PACKAGE.finditer(text):
        name, version = found[1], found[2]
        yield Component(
            name=name,
            version=version,
            type=ComponentType.LIBRARY,
            purl=(purl := PackageURL("pypi", None, name, version)),
            bom_ref=purl.to_string(),
            hashes=[
                HashType(alg=HashAlgorithm.SHA_256, content=one)
                for one in re.findall("sha256:([0-9a-f]{64})", found["rest"])
            ],
        )


def bill() -> str:
    """Return the bill as JSON."""
    version = re.search('__version__ = "(.+)"', (ROOT / "gen" / "version.py").read_text(encoding="utf-8"))
    assert version is not None
    own = Component(
        name="sosmith",
        version=version[1],
        type=ComponentType.APPLICATION,
        bom_ref="sosmith",
        licenses=[LicenseExpression("Apache-2.0")],
    )
    made = Bom(components=[one for level in LEVELS for one in components(_text(level))])
    made.metadata.component = own
    made.register_dependency(own, list(made.components))
    # No time and no number of its own: the same packages are the same bytes.
    made.metadata.timestamp = None  # type: ignore[assignment]
    made.serial_number = None  # type: ignore[assignment]
    return JsonV1Dot6(made).output_as_string(indent=2) + "\n"


def _text(level: str) -> str:
    return (ROOT / "requirements" / f"{level}.txt").read_text(encoding="utf-8")


if __name__ == "__main__":
    Path(sys.argv[1]).write_text(bill(), encoding="utf-8")
