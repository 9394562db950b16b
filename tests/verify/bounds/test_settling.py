"""How long a filter that starts from zero is flagged: proven again, and what is wrong with it is found."""

import tomllib
from dataclasses import replace
from decimal import Decimal
from functools import cache
from pathlib import Path

import pytest
from tests.verify.small_specifications import PLAIN, STEADY

from sosmith.gen.core import CoreDesign, design_core
from sosmith.gen.output.certificate import certificate
from sosmith.gen.output.verilog import core_verilog
from sosmith.gen.specification.specification import from_tree
from sosmith.gen.word_lengths.settling import with_settling
from sosmith.verify.certificate_file import Certificate, NodeEntry, Operation
from sosmith.verify.graph import RejectedError
from sosmith.verify.parallel.check import check_hardware
from sosmith.verify.program.check import check_program
from sosmith.verify.verification import verify


@cache
def made(text: str = PLAIN, architecture: str = "parallel", realization: str = "df1_ef1", order: int = 2) -> CoreDesign:
    spec = from_tree(tomllib.loads(text, parse_float=Decimal), Path("small.toml"))
    hardware = replace(spec.hardware, architecture=architecture, realization=realization)
    return design_core(replace(spec, hardware=hardware, filter=replace(spec.filter, order=order)))


def certified(design: CoreDesign, samples: int = 0) -> Certificate:
    """Certify a design, with another number of samples flagged than it asks for if that is given."""
    quantized = design.quantized
    if samples:
        quantized = replace(quantized, datapath=with_settling(quantized.datapath, samples))
    return certificate(quantized, design.spec.max_error)


def with_node(whole: Certificate, name: str, **changes: object) -> Certificate:
    """Change a node of the counter."""
    last = whole.stages[-1]
    nodes: list[NodeEntry] = [node.model_copy(update=changes) if node.name == name else node for node in last.nodes]
    return whole.model_copy(update={"stages": (*whole.stages[:-1], last.model_copy(update={"nodes": tuple(nodes)}))})


@pytest.mark.sweep(4)
@pytest.mark.parametrize("order", [1, 3])
@pytest.mark.parametrize("realization", ["df1", "df1_ef2", "df2t", "delta", "state_space", "lattice_wdf"])
def test_is_enough_and_hardly_more(realization: str, order: int) -> None:
    design = made(realization=realization, order=order)
    samples = design.quantized.settling
    verify(certified(design))
    with pytest.raises(
        RejectedError,
        match=rf"^another past must change the output by at most 1/2 LSB from sample {samples - 2} after a start, ",
    ):
        verify(certified(design, samples - 2))


def test_counts_as_claimed() -> None:
    whole = certified(made())
    samples = whole.claims.settling
    assert samples is not None
    early = whole.model_copy(update={"claims": whole.claims.model_copy(update={"settling": samples + 1})})
    with pytest.raises(RejectedError, match=rf"^the flag of output_stage must be -1 at sample {samples}, not 0$"):
        verify(early)
    none = whole.model_copy(update={"claims": whole.claims.model_copy(update={"settling": None})})
    with pytest.raises(RejectedError, match=r"^the last stage must have 1 outputs as claimed, not 2$"):
        verify(none)
    ends = {"parameter": samples - 1, "low": samples - 1, "high": samples - 1}
    with pytest.raises(RejectedError, match=r"^node \d+ \(.*\) of output_stage must have the range "):
        verify(with_node(whole, "samples", **ends))


def test_the_flag_depends_on_no_sample() -> None:
    whole = certified(made())
    last = whole.stages[-1]
    x = next(i for i, node in enumerate(last.nodes) if node.op is Operation.INPUT)
    wrong = last.model_copy(update={"outputs": (last.outputs[0], x)})
    with pytest.raises(RejectedError, match=r"^the flag of output_stage must depend on the first nodes alone$"):
        verify(whole.model_copy(update={"stages": (*whole.stages[:-1], wrong)}))


def test_a_filter_from_its_first_sample_has_no_flag() -> None:
    design = made(STEADY)
    assert design.quantized.settling == 0
    assert not design.datapath.settles
    assert certified(design).claims.settling is None
    with pytest.raises(
        RejectedError, match=r"^settling must not be claimed of a filter that starts from its first sample$"
    ):
        verify(certified(design, 10))


@pytest.mark.sweep(1)
@pytest.mark.parametrize("architecture", ["parallel", "folded", "serial"])
def test_hardware_that_flags_one_sample_less_is_found(architecture: str) -> None:
    """The text of another core, whose counter ends a sample early, against the certificate."""
    design = made(architecture=architecture)
    quantized, samples = design.quantized, design.quantized.settling
    other = with_settling(quantized.datapath, samples - 1)
    early = replace(
        design,
        quantized=replace(quantized, datapath=other),
        architecture=replace(design.architecture, datapath=other),
    )
    for core, is_right in ((design, True), (early, False)):
        text = core_verilog(core)
        check = check_hardware if architecture == "parallel" else check_program
        if is_right:
            check(text, certified(design))
        else:
            with pytest.raises(RejectedError):
                check(text, certified(design))


@pytest.mark.slow  # half a minute
def test_what_is_just_within_the_longest_response_of_a_design_is_decided() -> None:
    """To far less than a design looks at: at 1/320,000 of the rate."""
    design = made(PLAIN.replace("cutoff = 20.0", "cutoff = 0.00031"), order=1)
    samples = design.quantized.settling
    assert samples > 200_000
    assert verify(certified(design)).bound <= 1
