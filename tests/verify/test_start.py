"""The start of a filter from its first sample: proven again, rejected when any part of it is wrong, and in hardware."""

import copy
import json
import tomllib
from collections.abc import Callable
from decimal import Decimal
from fractions import Fraction
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tests.gen.word_lengths.filters import butterworth, plain
from tests.gen.word_lengths.steady import CURRENT, ripple, steady_design
from tests.verify.certificate_edits import all_edits, proven, rejected, wrongly_accepted
from tests.verify.parallel.cores import made as parallel
from tests.verify.parallel.cores import small as small_parallel
from tests.verify.program.programs import small as small_folded
from tests.verify.small_specifications import PLAIN, STEADY, STEADY_INSTRUMENT

from sosmith.gen.core import design_core
from sosmith.gen.output.certificate import certificate
from sosmith.gen.realizations.registry import SECTIONS
from sosmith.gen.specification.specification import from_tree
from sosmith.model.port import Port
from sosmith.verify.certificate_file import Certificate, Operation, certificate_text
from sosmith.verify.graph import RejectedError
from sosmith.verify.specified.stated_specification import check_specification
from sosmith.verify.start import check_start, section_alone
from sosmith.verify.verification import verify

# What is right is proven.


@pytest.mark.sweep(1)
@pytest.mark.parametrize("kind", ["lowpass", "highpass", "bandpass", "bandstop"])
@pytest.mark.parametrize(
    "realization",
    [name if name in {"df1_ef2", "lattice_wdf"} else pytest.param(name, marks=pytest.mark.slow) for name in SECTIONS],
)
def test_designs(kind: str, realization: str) -> None:
    proven(plain(butterworth(3, 0.1, kind), realization, steady=True))


@pytest.mark.parametrize(
    "name", ["flange_wear_bench.toml", pytest.param("flange_wear_locomotive.toml", marks=pytest.mark.slow)]
)
def test_examples(name: str) -> None:
    design = steady_design(name)
    proven(design.quantized, design.spec.max_error)


@pytest.mark.slow
def test_a_range_without_zero_and_a_gain_that_is_not_1() -> None:
    proven(plain(ripple(), inputs=CURRENT, output=Port.from_range("y", 12, Fraction(4), Fraction(20)), steady=True))


# What is wrong is rejected.


@cache
def text_of(spec: str) -> str:
    made = design_core(from_tree(tomllib.loads(spec, parse_float=Decimal), Path("small.toml")), realization="df1_ef2")
    return certificate_text(certificate(made.quantized, made.spec.max_error))


def tree_of(spec: str = STEADY) -> Any:
    return json.loads(text_of(spec))


@pytest.mark.slow
def test_one_unit_off_in_any_number_is_rejected() -> None:
    tree = tree_of(STEADY_INSTRUMENT)
    chosen = all_edits(tree)
    starts = [edit for edit in chosen if edit[0][0] == "stages" and tree["stages"][edit[0][1]]["role"] == "start"]
    others = [chosen[k] for k in np.random.default_rng(13).permutation(len(chosen))[:60]]
    assert len(starts) > 50
    assert wrongly_accepted(tree, starts + others) == []


def stage(tree: Any, name: str) -> Any:
    return next(found for found in tree["stages"] if found["name"] == name)


def node(tree: Any, of: str, name: str) -> Any:
    return next(found for found in stage(tree, of)["nodes"] if found.get("name") == name)


def lie(edit: Callable[[Any], object], spec: str) -> Any:
    tree = copy.deepcopy(tree_of(spec))
    edit(tree)
    return tree


def holds_every_sample(tree: Any) -> None:
    """Let the state take over each sample, not just the first one."""
    node(tree, "start", "first")["operands"] = [0]


def never_starts(tree: Any) -> None:
    """Keep the bit at 0: every sample counts as the first one."""
    nodes = stage(tree, "start")["nodes"]
    (one,) = (found for found in nodes if found["op"] == "constant")
    one.update(low=0, high=0, parameter=0)
    node(tree, "start", "started")["high"] = 0
    node(tree, "start", "since").update(low=0, high=0)


def without_the_stage(tree: Any) -> None:
    tree["stages"] = [found for found in tree["stages"] if found["name"] != "start"]


@pytest.mark.parametrize(
    ("edit", "spec", "message"),
    [
        pytest.param(
            holds_every_sample,
            STEADY,
            r"node 3 \(delay first\) of start must keep what the first sample gave it",
            id="holds every sample",
        ),
        pytest.param(
            never_starts,
            STEADY,
            r"node 5 \(subtract\) of start must have the range .*",
            id="never starts",
        ),
        pytest.param(
            lambda t: node(t, "start", "held").update(high=126),
            STEADY,
            r"node 3 \(delay first\) of start must have the range -128\.\.126, not -128\.\.127",
            id="narrow",
        ),
        pytest.param(
            lambda t: t["ideal"].pop("start"),
            STEADY,
            "there must be 0 start stages, as the ideal filter says, not 1",
            id="of a filter that starts from zero",
        ),
        pytest.param(
            lambda t: t["ideal"].update(start="steady"),
            PLAIN,
            "there must be 1 start stages, as the ideal filter says, not 0",
            id="of a filter without a start",
        ),
        pytest.param(
            lambda t: stage(t, "start").update(role="section"),
            STEADY,
            "there must be 1 start stages, as the ideal filter says, not 0",
            id="as a section",
        ),
        pytest.param(
            lambda t: t["claims"]["budget"].update(start="0"),
            STEADY,
            r"the part start of the budget must be 1/18446744073709551616 = 5\.42101e-20, not 0 = 0",
            id="part too small",
        ),
        pytest.param(without_the_stage, STEADY, "section0 must have 1 inputs, not 2", id="left out"),
    ],
)
def test_a_wrong_start(edit: Callable[[Any], object], spec: str, message: str) -> None:
    rejected(lie(edit, spec), message)


@pytest.mark.parametrize(
    ("edit", "message"),
    [
        ({"held": {"high": 126}}, r"node 8 \(bound held\) of start must hold -128\.\.127, not -128\.\.126"),
        ({"change": {"low": -254}}, r"node 6 \(bound change\) of start must hold -255\.\.255, not -254\.\.255"),
        ({"first": {"operands": (0,)}}, r"node 3 \(delay first\) of start must keep what the first sample gave it"),
        (
            {"since": {"operands": (0, 0)}},
            r"node 4 \(multiply since\) of start must not multiply samples with each other",
        ),
        ({"since": {"op": Operation.FLOOR}}, r"node 4 \(floor since\) of start must not be in a start stage"),
        ({"held": {"operands": (0,)}}, r"node 3 \(delay first\) of start must keep what the first sample gave it"),
    ],
)
def test_a_stage_by_itself(edit: dict[str, dict[str, Any]], message: str) -> None:
    made = next(found for found in Certificate.model_validate(tree_of()).stages if found.name == "start")
    assert check_start(made).windows == [(0, 255), (-255, 0)]
    nodes = tuple(found.model_copy(update=edit.get(found.name, {})) for found in made.nodes)
    with pytest.raises(RejectedError, match=f"^{message}$"):
        check_start(made.model_copy(update={"nodes": nodes}))


@pytest.mark.parametrize(
    ("outputs", "message"),
    [
        ((0, 8), r"node 0 \(input x\) of start must be 0 and then every sample less the first one"),
        ((6, 0), r"node 0 \(input x\) of start must be the first sample"),
        ((6, 8, 8), r"start must have one input and one or two outputs, not \(1, 3\)"),
    ],
)
def test_wrong_outputs(outputs: tuple[int, ...], message: str) -> None:
    made = next(found for found in Certificate.model_validate(tree_of()).stages if found.name == "start")
    with pytest.raises(RejectedError, match=f"^{message}$"):
        check_start(made.model_copy(update={"outputs": outputs}))


def test_what_passes_beside_a_section_is_used_nowhere_else() -> None:
    made = next(found for found in Certificate.model_validate(tree_of()).stages if found.name == "section0")
    last = len(made.nodes) - 1
    assert section_alone(made).nodes == made.nodes[:last]
    delays = [index for index, found in enumerate(made.nodes) if found.op is Operation.DELAY]
    users = [*made.nodes]
    users[delays[0]] = users[delays[0]].model_copy(update={"operands": (last,)})
    for wrong in ({"nodes": tuple(users)}, {"outputs": made.outputs[:1] * 2}, {"outputs": (last, last)}):
        with pytest.raises(
            RejectedError,
            match=r"^section0 must pass on the first sample as its last input and output, and use it for nothing else$",
        ):
            section_alone(made.model_copy(update=wrong))


def test_the_start_is_that_of_the_specification() -> None:
    for text, other, stated, found in ((STEADY, PLAIN, "steady", "zero"), (PLAIN, STEADY, "zero", "steady")):
        read = Certificate.model_validate(tree_of(text))
        margin = verify(read).margin
        check_specification(read, text, margin)
        with pytest.raises(
            RejectedError, match=f"^the start of the filter must be {found} as specified, not {stated}$"
        ):
            check_specification(read, other, margin)


# In the hardware.


@pytest.mark.sweep(1)
@pytest.mark.parametrize("channels", [1, 3])
@pytest.mark.parametrize("realization", ["df1_ef1", "df2t"])
def test_parallel_hardware(realization: str, channels: int) -> None:
    small_parallel(STEADY, realization, channels).check()


@pytest.mark.slow
def test_parallel_hardware_of_an_example() -> None:
    parallel(steady_design("audio_lowpass.toml", architecture="parallel")).check()


@pytest.mark.slow
@pytest.mark.parametrize("architecture", ["folded", "serial"])
def test_programs(architecture: str) -> None:
    small_folded(STEADY, architecture).check()
    small_folded(STEADY_INSTRUMENT, architecture).check()


def test_hardware_that_starts_from_zero_is_not_that_of_the_certificate() -> None:
    for steady, zero in ((small_parallel(STEADY), small_parallel(PLAIN)), (small_folded(STEADY), small_folded(PLAIN))):
        with pytest.raises(RejectedError):
            steady.check(zero.text)


def test_a_first_sample_that_is_not_held_is_rejected() -> None:
    core = small_parallel(STEADY)
    edits = {
        "started <= 1'h1": "started <= 1'h0",
        "if (rst) first <= 8'h00": "if (0) first <= 8'h00",
        "assign first_load = & { not_started, take0 };": "assign first_load = take0;",
        "if (first_load) first <= x;": "if (first_load) first <= { x[7:1], 1'h0 };",
        ".held(start_held)": ".held(start_change[7:0])",
    }
    for before, after in edits.items():
        assert before in core.text
        with pytest.raises(RejectedError):
            core.check(core.text.replace(before, after))
