"""Proves the certificate of a chain: its stages one by one, and what is claimed of all of them together.

The sum over all stages of an error and how much of it reaches the end bounds the whole, if every port between stages
holds all that can pass it: the exact value, which the response up to there bounds, and the errors made before it.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from functools import partial
from pathlib import Path

from sosmith.verify.bounds.l1_response import UndecidedError
from sosmith.verify.certificate_file import (
    Certificate,
    FileEntry,
    ItemEntry,
    PortEntry,
    entries_in,
    entries_text,
    on_grid,
)
from sosmith.verify.chain.c_model import check_chain_model
from sosmith.verify.chain.chain_file import ChainCertificate, ChainStageEntry, sealed_chain
from sosmith.verify.chain.flags import FlagsClaim, timing_of
from sosmith.verify.chain.folding import check_folding, check_limited
from sosmith.verify.chain.manifest import check_chain_manifest
from sosmith.verify.chain.responses import Part, factor_of, parts_of, peak_gain, reach_of, rise_of
from sosmith.verify.chain.top import Stage, check_top
from sosmith.verify.chain.words import check_words
from sosmith.verify.graph import RejectedError, require
from sosmith.verify.multirate.decimation import samples_of_filter
from sosmith.verify.verdict.door import Judgement, Stated, judge
from sosmith.verify.verdict.generated_files import about_of, ascii_text, content_of, sha256, unicode_text
from sosmith.verify.verdict.limits import SECONDS, limited
from sosmith.verify.verdict.scope import Part as ScopePart
from sosmith.verify.verdict.scope import State
from sosmith.verify.verdict.shared_hardware import SharedHardware, check_shared_hardware
from sosmith.verify.verification import Progress

_OWN_FILES = ("{}.sv", "{}.json", "{}.c", "{}.h")
_GRID = Fraction(1, 1 << 64)
_RISING = ("fir", "halfband", "cic")
"""Kinds of stages that may be several cores."""

Groups = Sequence[tuple[Certificate, ...]]
"""The certificates of each stage's cores."""

_PLAIN = re.compile(r"[A-Za-z_]\w{0,199}", re.ASCII)


@dataclass(frozen=True)
class ChainJudgement:
    """What is proven of a chain.

    Attributes
    ----------
    stages : mapping of str to Judgement
        Of each stage, by its name.
    bound : Fraction
        Bound on the error from end to end, in the unit of the output.
    budget : mapping of str to Fraction
        What each stage adds to it.
    files : int
        Files that were compared, those of the stages included.
    scope : mapping of str to Part
        How much of each part is proven.
    """

    stages: Mapping[str, Judgement]
    bound: Fraction
    budget: Mapping[str, Fraction]
    files: int
    scope: Mapping[str, ScopePart] = field(default_factory=dict)


def judge_chain(
    chain: ChainCertificate,
    progress: Progress,
    *,
    folder: Path,
    content: bytes,
    text: str | None = None,
    spec_folder: Path = Path(),
    with_files: bool = True,
    seconds: float = SECONDS,
) -> ChainJudgement:
    """Prove the certificate of a chain, and hold it against a specification and a folder of files.

    Parameters
    ----------
    chain : ChainCertificate
    progress : callable
        Called with the name of a step, the amount done and the total.
    folder : Path
        Folder of the stages' certificates, and of the files.
    content : bytes
        Content of the certificate's own file.
    text : str or None
        The specification.
    spec_folder : Path
        Its folder.
    with_files : bool
        Whether files are proven too.
    seconds : float
        Time that each stage, and the whole, may take, in s; 0 for any.

    Raises
    ------
    RejectedError
        If anything is wrong: what is only not proven is in the scope.
    """
    _check_names(chain)
    _check_seal(chain, content)
    groups, stages = list[tuple[Certificate, ...]](), dict[str, Judgement]()
    for entry in chain.stages:
        cores = [
            _read(chain, label, file, folder) for label, file in zip(_labels(entry), entry.certificates, strict=True)
        ]
        with limited(seconds):
            shared = _shared_hardware(chain, entry, cores, folder, progress) if with_files else {}
        for label, core in zip(_labels(entry), cores, strict=True):
            stated = None
            if text is not None:
                stated = _stated(core, spec_folder, "calibration" if entry.kind == "polynomial" else "filter")
            try:
                stages[label] = judge(
                    core,
                    partial(_named, progress, label),
                    stated=stated,
                    folder=folder if with_files else None,
                    content=entries_text(core).encode(),
                    seconds=seconds,
                    elsewhere=shared.get(core.name),
                )
            except RejectedError as error:
                raise RejectedError(f"stage {label}: {error}") from None
        groups.append(tuple(cores))
    with limited(seconds):
        progress("chain", 0, 0)
        items = _check_joints(chain, groups)
        flags = _flags(chain, groups, items)
        steady = any(item.start == "steady" for own in items for item in own)
        budget = _check_bound(chain, groups, steady=steady)
        progress("folding", 0, 0)
        try:
            parts = [parts_of(cores) for cores in groups]
            check_folding(chain.folding, [part for own in parts for part in own])
            check_limited(chain.limited, parts)
        except UndecidedError as error:
            raise RejectedError(f"{error} could not be decided") from None
        if text is not None:
            check_words(chain, text, groups, spec_folder)
        files = sum(len(stage.files) for stage in stages.values())
        if with_files:
            progress("files", 0, 0)
            files += _check_files(chain, folder, groups, items, stages, flags)
    loaded = [e.name for e, own in zip(chain.stages, items, strict=True) if len(own) > 1 and own[0].reload]
    scope = _scope(chain, stages, loaded, text is not None, with_files)
    return ChainJudgement(stages, chain.bound, budget, files, scope)


def _shared_hardware(
    chain: ChainCertificate, entry: ChainStageEntry, cores: Sequence[Certificate], folder: Path, progress: Progress
) -> dict[str, SharedHardware]:
    """Prove the hardware that the cores of a stage share, by their names; nothing if each has its own."""
    items = [about_of(core).item for core in cores]
    if not any(item is not None and item.shared for item in items):
        return {}
    module = f"{chain.name}_{entry.name}"
    digests = {file.name: file.sha256 for file in chain.files}
    texts = list[str]()
    for name in (f"{module}.sv", f"{module}.il"):
        require(name in digests, f"the files of the chain must have {name}")
        content = content_of(folder / name, links=False)
        _compare(str(folder / name), digests[name], content)
        texts.append(ascii_text(name, content))
    try:
        sv, il = texts
        proven = check_shared_hardware(sv, il, module, cores, partial(_named, progress, entry.name))
    except RejectedError as error:
        raise RejectedError(f"stage {entry.name}: {error}") from None
    return {core.name: each for core, each in zip(cores, proven, strict=True)}


def read_cores(chain: ChainCertificate, folder: Path) -> list[tuple[Certificate, ...]]:
    """Read the certificates of all stages' cores, which lie in a folder.

    Raises
    ------
    RejectedError
        If one is not the one that the chain names.
    SpecificationError
        If a file cannot be read.
    """
    _check_names(chain)
    return [
        tuple(_read(chain, label, file, folder) for label, file in zip(_labels(entry), entry.certificates, strict=True))
        for entry in chain.stages
    ]


def _labels(entry: ChainStageEntry) -> list[str]:
    """Return what the cores of a stage are called: its name, with the number of a result where there are several."""
    count = len(entry.certificates)
    return [entry.name] if count == 1 else [f"{entry.name}_p{k}" for k in range(count)]


def _read(chain: ChainCertificate, label: str, file: FileEntry, folder: Path) -> Certificate:
    """Read the certificate of a core, which is the one that the chain names."""
    name = f"{chain.name}_{label}"
    require(
        file.name == f"{name}.certificate.json",
        f"the certificate of stage {label} must be {name}.certificate.json, not {file.name}",
    )
    path = folder / file.name
    own = content_of(path, links=False)
    _compare(str(path), file.sha256, own)
    core = entries_in(own, path, Certificate)
    require(
        entries_text(core).encode() == own,
        f"the certificate of stage {label} must have the layout in which it was written, not another one",
    )
    require(core.name == name, f"the core of stage {label} must be {name}, not {core.name}")
    return core


def _stated(core: Certificate, spec_folder: Path, kind: str) -> Stated:
    data = about_of(core).measurements
    measured = None if data is None else spec_folder / data.name
    return Stated(about_of(core).specification, spec_folder, measured, kind)


def _named(progress: Progress, stage: str, step: str, done: int, total: int) -> None:
    progress(f"{stage}: {step}", done, total)


def _check_names(chain: ChainCertificate) -> None:
    """Check names of which those of files are made: no file of another folder is read, whatever they are."""
    names = [("chain", chain.name), *(("stage", entry.name) for entry in chain.stages)]
    for what, name in names:
        require(_PLAIN.fullmatch(name) is not None, f"the name of a {what} must be a plain identifier, not {name!r}")


def _check_seal(chain: ChainCertificate, content: bytes) -> None:
    own = sealed_chain(chain).certificate
    require(
        chain.certificate == own,
        f"the SHA-256 of the certificate itself must be {own}, not {chain.certificate}: it was changed",
    )
    require(
        entries_text(chain).encode() == content,
        "the certificate must have the layout in which it was written, not another one",
    )


def _compare(what: str, stated: str, content: bytes) -> None:
    digest = sha256(content)
    require(digest == stated, f"{what} must have the SHA-256 {stated} of the certificate, not {digest}")


def _check_joints(chain: ChainCertificate, groups: Groups) -> list[list[ItemEntry]]:
    """Check that each stage takes what the one before it gives, and that none has what a chain lacks."""
    items, starts = [], set[str]()
    names = [entry.name for entry in chain.stages]
    require(len(set(names)) == len(names), "the stages of a chain must have names of their own")
    for k, (entry, cores) in enumerate(zip(chain.stages, groups, strict=True)):
        taken = chain.inputs if k == 0 else (_unnamed(groups[k - 1][0].output),)
        own_items = []
        for label, core in zip(_labels(entry), cores, strict=True):
            own_items.append(_check_core(chain, entry, label, core, first=k == 0))
            own = core.inputs if k == 0 else tuple(map(_unnamed, core.inputs))
            require(own == taken, f"stage {label} must take what is before it, {taken}, not {own}")
            require(core.output == cores[0].output, f"the cores of stage {entry.name} must give the same, not others")
        if entry.kind != "polynomial":
            starts |= {item.start for item in own_items}
        _check_beside(entry, own_items)
        items.append(own_items)
    last = groups[-1][0].output
    require(_unnamed(last) == _unnamed(chain.output), "the last stage must give the output of the chain")
    require(len(starts) < 2, f"all stages must start alike, not from {' and '.join(sorted(starts))}")
    return items


def _check_core(
    chain: ChainCertificate, entry: ChainStageEntry, label: str, core: Certificate, *, first: bool
) -> ItemEntry:
    """Check what a core of a stage is, by itself."""
    what, item = f"stage {label}", about_of(core).item
    if item is None:
        raise RejectedError(f"the certificate of {what} must state what the item is")
    alone = len(entry.certificates) == 1
    require(
        not item.reload or item.reload_registers == alone,
        f"{what} must have {'registers of its own' if alone else 'pins in their place'} where constants can be loaded",
    )
    require(not item.hold and item.samples == 1, f"{what} must be without hold and several samples a clock")
    require(item.channels == chain.channels, f"{what} must have {chain.channels} channels, not {item.channels}")
    require(
        (core.ideal.polynomial is not None) == (entry.kind == "polynomial"),
        f"{what} must have a polynomial if it is one, and no other",
    )
    require(entry.kind != "polynomial" or (first and not core.ideal.sections), "a polynomial must be the first stage")
    return item


def _check_beside(entry: ChainStageEntry, items: Sequence[ItemEntry]) -> None:
    """Check that cores of one stage have the same streams and check bits, and that all can be loaded, or none."""
    if len(items) == 1:
        return
    what = f"the cores of stage {entry.name}"
    require(entry.kind in _RISING, f"{what} must be one for the kind {entry.kind}, not {len(items)}")
    for item in items:
        for part in ("taken", "given", "flags", "calibrated", "protect", "reload", "shared"):
            require(getattr(item, part) == getattr(items[0], part), f"{what} must have the same {part}")


def _flags(chain: ChainCertificate, groups: Groups, items: Sequence[Sequence[ItemEntry]]) -> FlagsClaim | None:
    """Check for how many results a chain settles, and return what its flags must be; None for a single stage."""
    rates, settled = [], 0
    for cores in groups:
        own = parts_of(cores)
        rates.append((rise_of(own), factor_of(own)))
        settled += max((core.claims.settling or 0) * samples_of_filter(core) for core in cores)
        settled = -(-settled * rates[-1][0] // rates[-1][1])
    timing = timing_of(rates[1:])
    if len(groups) == 1 and len(groups[0]) > 1:  # each result of a sample has the flag of its own core
        settled = sum(core.claims.settling or 0 for core in groups[0])
    count, settling = timing.bringing(settled) if len(groups) > 1 else (settled, settled)
    require(chain.settling == settling, f"settling of the chain must be {settling} results, not {chain.settling}")
    if len(groups) == 1:
        return None
    first = items[0][0]
    return FlagsClaim(
        name=f"{chain.name}_flags",
        carried=2 if first.calibrated else 1,
        timing=timing,
        settling=count,
        channels=chain.channels,
        dest=first.given.dest_width,
        guarded=tuple(
            entry.name
            for entry, own_items in zip(chain.stages[:-1], items, strict=False)
            if own_items[0].protect != "none"
        ),
    )


def _unnamed(port: PortEntry) -> PortEntry:
    return port.model_copy(update={"name": ""})


def _check_bound(chain: ChainCertificate, groups: Groups, *, steady: bool) -> dict[str, Fraction]:
    """Check the gains, the errors, that no port between stages limits anything, and the sum."""
    parts = list(map(parts_of, groups))
    gain_of = partial(peak_gain, steady=steady)
    budget: dict[str, Fraction] = {}
    reach, carried = reach_of(groups[0][0]), Fraction(0)
    for k, (entry, cores) in enumerate(zip(chain.stages, groups, strict=True)):
        behind = [part for each in parts[k + 1 :] for part in each]
        gain = on_grid(gain_of(behind)) if behind else Fraction(1)
        require(
            gain <= entry.gain <= gain + 2 * _GRID,
            f"the gain behind stage {entry.name} must be {float(gain):.12g}, not {float(entry.gain):.12g}",
        )
        error, port = max(core.claims.bound for core in cores) * cores[0].output.lsb, cores[0].output
        require(error == entry.error, f"the error of stage {entry.name} must be {error}, not {entry.error}")
        budget[entry.name] = error * entry.gain
        if k == len(groups) - 1:
            break
        own = list(parts[k])
        carried = (carried * gain_of(own) if own else Fraction(0)) + error
        so_far: list[Part] = [part for each in parts[: k + 1] for part in each]
        largest = (reach * gain_of(so_far) if so_far else reach) + carried
        require(port.zero == 0 and port.signed, f"the port behind stage {entry.name} must be signed")
        require(
            largest < port.highest * port.lsb,
            f"the port behind stage {entry.name} must hold magnitudes of {float(largest):.6g}, "
            f"not end at {float(port.highest * port.lsb):.6g}",
        )
    bound = sum(budget.values(), Fraction(0))
    require(chain.bound == bound, f"the bound of the chain must be {float(bound):.12g}, not {float(chain.bound):.12g}")
    require(
        bound <= chain.max_error,
        f"the bound of the chain must be at most {float(chain.max_error):.6g}, not {float(bound):.6g}",
    )
    return budget


def _check_files(
    chain: ChainCertificate,
    folder: Path,
    groups: Groups,
    items: Sequence[Sequence[ItemEntry]],
    stages: Mapping[str, Judgement],
    flags: FlagsClaim | None,
) -> int:
    """Check the files of the whole; return how many there are."""
    names = [entry.name for entry in chain.files]
    joined = [
        Stage(entry.name, tuple(core.name for core in own), own_items[0])
        for entry, own, own_items in zip(chain.stages, groups, items, strict=True)
    ]
    wanted = [name.format(chain.name) for name in _OWN_FILES]
    for stage in joined:
        wanted += [f"{stage.shared_module}{end}" for end in (".sv", ".il") if stage.item.shared]
    wanted += [f"{chain.name}_{stage.name}{end}" for stage in joined if stage.loads for end in ("_registers.h", ".rdl")]
    require(names == wanted, f"the files of the chain must be {', '.join(wanted)}, not {', '.join(names)}")
    contents = {}
    for entry in chain.files:
        contents[entry.name] = content_of(folder / entry.name, links=False)
        _compare(str(folder / entry.name), entry.sha256, contents[entry.name])
    sv, json, c, h = wanted[: len(_OWN_FILES)]
    cores = [core for each in groups for core in each]
    texts = [
        ascii_text(f"{core.name}.sv", stage.files[f"{core.name}.sv"])
        for core, stage in zip(cores, stages.values(), strict=True)
        if f"{core.name}.sv" in stage.files
    ]
    shared = [f"{stage.shared_module}.sv" for stage in joined if stage.item.shared]
    texts += [ascii_text(name, contents[name]) for name in shared]
    top = ascii_text(sv, contents[sv])
    check_top(texts, top, chain.name, joined, flags)
    check_chain_manifest(contents[json], chain, groups, items)
    check_chain_model(unicode_text(c, contents[c]), unicode_text(h, contents[h]), chain, groups, flags)
    return len(contents)


def _scope(
    chain: ChainCertificate, stages: Mapping[str, Judgement], loaded: Sequence[str], specified: bool, with_files: bool
) -> dict[str, ScopePart]:
    """Return how much of each part is proven: of the stages together, and of the chain."""
    scope: dict[str, ScopePart] = {}
    for name in next(iter(stages.values())).scope:
        scope[name] = _together({stage: each.scope[name] for stage, each in stages.items()})
    gains = "each stage's error and its gain to the end bound the whole, and no port between stages limits what passes"
    folds = "; no alias or image has more than the gains that are claimed" if chain.folding else ""
    if chain.limited is not None or any(entry.kept is not None for entry in chain.folding):
        folds += "; gains in the pass band lie between those that are claimed"
    chained = {"chain": ScopePart(State.PROVEN, gains + folds)}
    if specified:
        whole = "the whole keeps to its" if chain.limited is None else "some of them by themselves keep to their"
        kept = f", and {whole} limits" if "pass band" in folds else ""
        chained["stages"] = ScopePart(State.PROVEN, f"each stage is the one that the words of the chain ask for{kept}")
    if with_files:
        has = "it has the cores, wires between their streams, and what joins their flags; manifest and C model follow"
        shared = f"{has}; not proven are the registers that the cores of {' and '.join(loaded)} share"
        chained["top"] = ScopePart(State.PARTIAL, shared) if loaded else ScopePart(State.PROVEN, has)
    return chained | scope


def _together(parts: Mapping[str, ScopePart]) -> ScopePart:
    """Return what is proven of a part in all stages; the least of it, and why."""
    order = (State.NOT_READ, State.PARTIAL, State.PROVEN)
    asked = {stage: part for stage, part in parts.items() if part.asked} or parts
    least = min((part.state for part in asked.values()), key=order.index)
    reasons = {part.why for part in asked.values() if part.state is least}
    whose = [stage for stage, part in asked.items() if part.state is least]
    why = reasons.pop() if len(reasons) == 1 else "; ".join(f"{stage}: {asked[stage].why}" for stage in whose)
    if len(whose) < len(asked) and least is not State.PROVEN:
        why = f"{', '.join(whose)}: {why}" if len(whose) == 1 else why
    return ScopePart(least, why, any(part.asked for part in parts.values()))
