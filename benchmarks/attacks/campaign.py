"""Attacks one core after the other, and asks the tools about all that is accepted."""

from __future__ import annotations

import copy
import hashlib
import json
import tempfile
import time
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from pathlib import Path
from typing import Any

from benchmarks.attacks import certificates, texts
from benchmarks.attacks.cores import NAME, SPECIFICATIONS, Core, made
from benchmarks.attacks.differences import difference
from benchmarks.attacks.tools import TOOLS, traces
from tests.verify.reader.netlists import netlists

from sosmith.interface.certificate import Certificate, State
from sosmith.model.errors import ShortfallError, SpecificationError, ToolError
from sosmith.verify.certificate_file import Certificate as Entries
from sosmith.verify.certificate_file import certificate_text, read_certificate, sealed
from sosmith.verify.graph import RejectedError
from sosmith.verify.reader.second_reader import compare_readings
from sosmith.verify.reader.source import Source, read_source

READ_AGAIN = 40
"""Texts of a core, of those that are read and not accepted, that the second reader reads."""
SECONDS = 60.0
"""Time that any verdict may take."""


@dataclass
class Outcome:
    """What became of the attacks on a core."""

    counts: Counter[str] = field(default_factory=Counter)
    classes: Counter[str] = field(default_factory=Counter)
    findings: list[str] = field(default_factory=list)
    slowest: float = 0.0

    def add(self, other: Outcome) -> None:
        """Add those of another core."""
        self.counts += other.counts
        self.classes += other.classes
        self.findings += other.findings
        self.slowest = max(self.slowest, other.slowest)

    def tree(self) -> dict[str, Any]:
        """Return all of it in JSON types."""
        # Not by `asdict`, which counts the pairs of a Counter up to Python 3.11.
        counts, classes = (dict(sorted(counter.items())) for counter in (self.counts, self.classes))
        return {"counts": counts, "classes": classes, "findings": self.findings, "slowest": self.slowest}

    def timed(self, what: str, judge: Callable[[], str]) -> str:
        """Return a verdict: "accepted", or a sentence; anything else that is raised is a finding."""
        start = time.process_time()
        try:
            found = judge()
        except (ShortfallError, SpecificationError) as error:
            found = str(error) or "no words"
        except Exception as error:
            self.findings.append(f"{what}: {type(error).__name__} {str(error)[:200]}")
            found = "traceback"
        taken = time.process_time() - start
        self.slowest = max(self.slowest, taken)
        if taken > SECONDS:
            self.findings.append(f"{what}: {taken:.0f} s")
        return found


def attacked(kind: str, wrong_texts: int, wrong_certificates: int) -> Outcome:
    """Attack a core of a kind with so many texts and certificates."""
    with tempfile.TemporaryDirectory() as folder:
        core = made(kind, Path(folder) / "core")
        outcome = Outcome()
        _judge_the_right(core, outcome)
        _attack_texts(core, wrong_texts, Path(folder), outcome)
        _attack_certificates(core, wrong_certificates, outcome)
        return outcome


def _judge_the_right(core: Core, outcome: Outcome) -> None:
    """Count it as a finding where a core's own files are refused: all that is wrong would be, too."""
    verdict = outcome.timed(core.kind, lambda: _file_verdict(core, core.certificate.read_text(encoding="utf-8")))
    if verdict != "accepted":
        outcome.findings.append(f"{core.kind}: its own files are refused: {verdict}")


# Texts.


def _attack_texts(core: Core, count: int, folder: Path, outcome: Outcome) -> None:
    right = read_source(core.text, NAME)
    accepted, read = [core.text], []
    for number in range(count):
        name = f"text {number} of {core.kind}"
        group, text = texts.mutant(core.text, f"{core.kind}/{number}")
        outcome.counts["texts"] += 1
        outcome.classes[f"text, {group}"] += 1
        sources: list[Source] = []
        verdict = outcome.timed(name, lambda text=text, sources=sources: _read(text, sources))
        if not sources:
            outcome.counts["texts, refused by the reader"] += 1
            continue
        verdict = outcome.timed(name, lambda text=text: _text_verdict(core, text))
        if verdict == "accepted" or (verdict == "read" and sources[0].text == right.text):
            outcome.counts["texts, accepted"] += 1
            outcome.classes[f"accepted, {group}"] += 1
            accepted.append(text)
        elif verdict == "read":
            outcome.counts["texts, read and not proven"] += 1
            read.append(text)
        else:
            outcome.counts["texts, refused by the proof"] += 1
            read.append(text)
    _ask_the_tools(core, list(dict.fromkeys(accepted)), right, folder, outcome)
    _read_again(core, list(dict.fromkeys(read))[:READ_AGAIN], outcome)


def _read(text: str, sources: list[Source]) -> str:
    if not text.isascii():
        raise RejectedError("the SystemVerilog must be ASCII")
    sources.append(read_source(text, NAME))
    return "read"


def _text_verdict(core: Core, text: str) -> str:
    """Return what `verify` says of a core with another text, whose digests are right."""
    path = core.folder / f"{NAME}.sv"
    before = path.read_bytes()
    try:
        path.write_bytes(text.encode())
        entries = read_certificate(core.certificate)
        proof = Certificate(_resealed(entries.model_dump(mode="json"), core.folder)).verify(
            files=core.folder, seconds=SECONDS
        )
    finally:
        path.write_bytes(before)
    return "accepted" if proof.scope["hardware"].state is State.PROVEN else "read"


def _resealed(tree: Any, folder: Path) -> Entries:
    """Return a certificate with digests that are right."""
    about = tree["about"] if isinstance(tree, dict) else None
    if isinstance(about, dict):
        for entry in about.get("files") or []:
            path = folder / Path(str(entry.get("name", ""))).name
            if path.is_file() and entry.get("sha256") != "0" * 64:
                entry["sha256"] = hashlib.sha256(path.read_bytes()).hexdigest()
        about["sha256"] = hashlib.sha256(about["specification"].encode()).hexdigest()
    return sealed(Entries.model_validate(tree))


def _ask_the_tools(core: Core, accepted: Sequence[str], right: Source, folder: Path, outcome: Outcome) -> None:
    """Hold the traces of all accepted texts against that of the right one, which is the first."""
    channels = int(core.kind.split(", ")[1].split()[0]) if "channels" in core.kind else 1
    found = traces(accepted, right.modules[NAME], channels, core.clocks, folder / "tools")
    wanted = found[TOOLS[0]][0]
    for tool in TOOLS:
        outcome.counts[f"traces, {tool}"] += len(accepted)
        for text, trace in zip(accepted, found[tool], strict=True):
            if trace != wanted or "x" in trace:
                where = difference(core.text, text)
                outcome.findings.append(f"{core.kind}: {tool} sees {trace}, not {wanted}, in {where}")


def _read_again(core: Core, read: Sequence[str], outcome: Outcome) -> None:
    """Have the second reader read texts that are read and not accepted: it must see the same."""
    if not read:
        return
    try:
        seen: list[str | None] = list(netlists(read, NAME))
    except ToolError:
        seen = []
        for text in read:
            try:
                seen += netlists([text], NAME)
            except ToolError as error:
                seen.append(None)
                where = difference(core.text, text)
                outcome.findings.append(f"{core.kind}: Yosys refuses {where}: {str(error)[-200:]}")
    for text, netlist in zip(read, seen, strict=True):
        if netlist is None:
            continue
        outcome.counts["texts, read by the second reader too"] += 1
        try:
            compare_readings(read_source(text, NAME).modules, netlist)
        except RejectedError as error:
            outcome.findings.append(f"{core.kind}: {error} in {difference(core.text, text)}")


# Certificates.


def _attack_certificates(core: Core, count: int, outcome: Outcome) -> None:
    tree = read_certificate(core.certificate).model_dump(mode="json", exclude_defaults=True)
    text = core.certificate.read_text(encoding="utf-8")
    for number in range(count):
        name, seed = f"certificate {number} of {core.kind}", f"{core.kind}/{number}"
        outcome.counts["certificates"] += 1
        if number % 10 == 0:
            group, other, wrong = "layout", None, certificates.spoilt_layout(text, seed)
            verdict = outcome.timed(name, lambda wrong=wrong: _file_verdict(core, wrong))
        else:
            wrong = ""
            group, other = certificates.mutant(tree, seed)
            verdict = outcome.timed(name, lambda other=other: _certificate_verdict(core, other))
        outcome.classes[f"certificate, {group}"] += 1
        if verdict != "accepted":
            outcome.counts["certificates, refused"] += 1
            continue
        outcome.counts["certificates, accepted"] += 1
        if other is None:  # blanks between the parts of JSON are none of it
            stronger = [] if json.loads(wrong) == json.loads(text) else ["the layout"]
        else:
            stronger = differing(_plain(tree), _plain(json.loads(json.dumps(other))))
        outcome.findings += [f"{name}: accepted with {place}" for place in stronger]


def _certificate_verdict(core: Core, tree: Any) -> str:
    try:
        entries = _resealed(json.loads(json.dumps(tree)), core.folder)
        text = certificate_text(entries)
        text.encode()
    except (ValueError, KeyError, TypeError, AttributeError):  # no certificate: its file would be refused as such
        return _file_verdict(core, json.dumps(tree))
    return _file_verdict(core, text)


def _file_verdict(core: Core, text: str) -> str:
    """Return what `verify` says of a certificate's file."""
    path = core.folder / "wrong.certificate.json"
    path.write_bytes(text.encode("utf-8", "surrogatepass"))
    Certificate.load(path).verify(files=core.folder, spec=core.folder / "spec.toml", seconds=SECONDS)
    return "accepted"


_FREE = (("about", "options"), ("about", "versions"), ("about", "certificate"), ("about", "sha256"), ("about", "files"))
"""Places in a certificate that claim nothing that the digests and the proof do not hold."""


def _plain(tree: Any) -> Any:
    """Return a certificate as the verifier takes it: without what is stated by default, and with sums in one order."""
    made = copy.deepcopy(tree)
    for stage in made["stages"]:
        for node in stage["nodes"]:
            for name in ("parameter", "parameter_frac"):
                if node.get(name) == 0:
                    del node[name]
            if node["op"] in {"add", "multiply"}:
                node["operands"] = sorted(node["operands"])
    return made


def differing(before: Any, after: Any) -> list[str]:
    """Return the places where an accepted certificate says something else that counts."""
    here, there = (
        {place: certificates.at(tree, place) for place in certificates.leaves(tree)} for tree in (before, after)
    )
    places = sorted({place for place in here.keys() | there.keys() if here.get(place) != there.get(place)}, key=str)
    return [
        f"{'.'.join(map(str, place))}: {str(there.get(place))[:60]} in place of {str(here.get(place))[:60]}"
        for place in places
        if not _does_not_count(place, before, after)
    ]


def _does_not_count(place: certificates.Place, before: Any, after: Any) -> bool:
    if place[:2] in _FREE or place[-1] == "name":
        return True
    try:
        one, other = (certificates.at(tree, place) for tree in (before, after))
        if certificates.is_rational(one) and certificates.is_rational(other):
            return Fraction(one) == Fraction(other)
        node = certificates.at(before, place[:-1])
        return place[-1] in {"low", "high"} and node["op"] == "bound"
    except (KeyError, IndexError, TypeError):
        return False


def kinds() -> list[str]:
    """Return the kinds of cores."""
    return list(SPECIFICATIONS)
