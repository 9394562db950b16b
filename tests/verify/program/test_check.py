"""The program of folded and serial cores: proven against the certificate's graph, rejected when a bit is wrong."""

import random
import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from tests.gen.designs import ALL, EXAMPLES
from tests.verify.program.programs import Made, changed, made, number_of, small, specified
from tests.verify.small_specifications import INSTRUMENT, PLAIN

from sosmith.gen.architectures.registry import ARCHITECTURES
from sosmith.gen.core import design_core
from sosmith.gen.output.verilog import to_rtlil, to_verilog
from sosmith.gen.specification.specification import load
from sosmith.hdl.plan.instructions import address_bits, encoded, instruction_bits
from sosmith.model.dataflow.program import EARLY_WRITES, LATE_WRITES, PRODUCTS, Instruction, Opcode, Program
from sosmith.verify.graph import RejectedError
from sosmith.verify.program.check import _check_order, _Run, check_program
from sosmith.verify.program.graph_forms import joined
from sosmith.verify.program.normal_form import constant, plus, scaled
from sosmith.verify.program.run import one_bit_away, samples
from sosmith.verify.program.text import read_program

FOLDABLE = ("df1", "df1_ef1", "df1_ef2", "df2t", "delta", "state_space")
LOCOMOTIVE = "flange_wear_locomotive.toml"


# What the generator writes is accepted.


@pytest.mark.sweep(1)
@pytest.mark.parametrize("architecture", ["folded", "serial"])
@pytest.mark.parametrize("name", ALL)
def test_examples(name: str, architecture: str) -> None:
    spec = load(EXAMPLES / name)
    design = design_core(
        replace(spec, hardware=replace(spec.hardware, architecture=architecture)), realization="df1_ef2"
    )
    verdict = made(design, architecture).check()
    assert verdict.instructions > 70
    assert verdict.values > 5
    assert verdict.states > 5


@pytest.mark.sweep(2)
@pytest.mark.parametrize("architecture", ["folded", "serial"])
@pytest.mark.parametrize("realization", FOLDABLE)
@pytest.mark.parametrize("spec", [PLAIN, INSTRUMENT], ids=["plain", "instrument"])
def test_every_realization(spec: str, realization: str, architecture: str) -> None:
    core = small(spec, architecture, realization)
    assert core.check().instructions == len(core.program.instructions)


@pytest.mark.sweep(1)
@pytest.mark.parametrize("architecture", ["folded", "serial"])
def test_channels_have_one_program(architecture: str) -> None:
    assert (
        small(INSTRUMENT, architecture, "df2t", channels=3).check() == small(INSTRUMENT, architecture, "df2t").check()
    )


@pytest.mark.slow
@pytest.mark.parametrize(("realization", "start"), [("delta", "zero"), ("df2t", "steady")])
def test_a_state_that_is_always_zero(realization: str, start: str) -> None:
    """As that of a section whose rounded poles cancel its zeros: what it takes over is like no node but a zero."""
    filters = "filter = { sos = [[0.25, 0.25, 0.0, 1.0, -0.5, 0.0], [1.0, 1e-9, 0.0, 1.0, 0.0, 0.0]] }"
    spec = re.sub(r"filter = .*", filters, PLAIN).replace('"faithful"', "0.5").replace('"zero"', f'"{start}"')
    core = small(spec, realization=realization)
    never = {node.name for stage in core.certificate.stages for node in stage.nodes if node.low == node.high == 0}
    assert never == {"s1", "t1"}
    assert core.check().instructions == len(core.program.instructions)


@pytest.mark.slow
@pytest.mark.parametrize("realization", ["delta", "df2t"])
def test_a_slow_filter(realization: str) -> None:
    """Its last states are 0 for a long time, and cannot be told apart until then."""
    spec = PLAIN.replace("order = 2, cutoff = 20.0", "order = 8, cutoff = 0.4").replace('"faithful"', "0.5")
    core = small(spec, realization=realization)
    assert core.check().instructions == len(core.program.instructions)


def slow_audio(order: int, cutoff: str, architecture: str) -> Made:
    text = (EXAMPLES / "audio_lowpass.toml").read_text(encoding="utf-8")
    text = re.sub(r"order = \d+", f"order = {order}", re.sub(r"cutoff = [\d.]+", f"cutoff = {cutoff}", text))
    return made(design_core(specified(text)), architecture)


@pytest.mark.slow
def test_sections_that_look_alike_for_a_long_time() -> None:
    """What the graph says is the floor of a state is held by that one, not by one that is the same in the samples."""
    core = slow_audio(10, "4.8", "folded")
    assert core.check().instructions == len(core.program.instructions)


@pytest.mark.slow
@pytest.mark.parametrize("architecture", ["folded", "serial"])
@pytest.mark.parametrize("cutoff", ["2.4", "4.8", "24.0", "400.0", "6000.0"])
@pytest.mark.parametrize("order", range(1, 13))
def test_orders_and_cutoffs(order: int, cutoff: str, architecture: str) -> None:
    core = slow_audio(order, cutoff, architecture)
    assert core.check().instructions == len(core.program.instructions)


NOTHING = re.sub(
    r"filter = .*",
    "filter = { sos = [[0.25, 0.5, 0.25, 1.0, -0.5, 0.25], [1.0, 0.0, 0.0, 1.0, 0.0, 0.0]] }",
    PLAIN,
).replace('"faithful"', "0.5")


@pytest.mark.slow
@pytest.mark.parametrize("start", ["zero", "steady"])
@pytest.mark.parametrize("realization", ["df1", "df1_ef1"])
def test_a_section_that_does_nothing(realization: str, start: str) -> None:
    """Its output is a floor like its input, but has a word of its own."""
    core = small(NOTHING.replace('"zero"', f'"{start}"'), realization=realization)
    assert core.check().states == 6 + (start == "steady")
    assert core.check().instructions == len(core.program.instructions)


def test_the_lower_digits_of_an_input_are_not_negative() -> None:
    """So says the width of the accumulator, which a digit with a sign would exceed."""
    filters = 'filter = { family = "elliptic", kind = "bandstop", order = 1, cutoff = [10.0, 26.0]'
    spec = re.sub(r"filter = .*", filters + ", passband_loss = 1.0, stopband_loss = 40.0 }", PLAIN)
    core = small(spec.replace("bits = 8", "bits = 24"), realization="df2t")
    assert core.check().instructions == len(core.program.instructions)


def test_the_calibration_alone() -> None:
    design = design_core(specified(INSTRUMENT), core="calibration")
    assert made(design, "folded").check().states == 0


# What is not the graph of the certificate is rejected.


def test_another_certificate_is_rejected() -> None:
    with pytest.raises(
        RejectedError, match=r"^instruction \d+ \(\w+, address \d+, constant -?\d+, target \d+\) must .*$"
    ):
        check_program(small(PLAIN).text, small(PLAIN, realization="df2t").certificate)


def test_a_wrong_coefficient_is_named() -> None:
    core = small(PLAIN)
    number, right = next(
        (k, i)
        for k, i in enumerate(core.program.instructions)
        if i.opcode in {Opcode.MULTIPLY, Opcode.STORE} and abs(i.constant) > 1000
    )
    text = changed(core, number, encoded(right._replace(constant=right.constant ^ 64), core.program))
    sentence = (
        rf"instruction {number} must be {right.opcode.mnemonic}, address {right.address}, constant {right.constant}, "
        rf"target {right.target} for node \d+ \(.+\) of section0, not {right.opcode.mnemonic}, "
        rf"address {right.address}, constant {right.constant ^ 64}, target {right.target}"
    )
    with pytest.raises(RejectedError, match=rf"^{sentence}$"):
        core.check(text)


@pytest.mark.sweep(1)
@pytest.mark.parametrize(
    ("opcode", "field", "sentence"),
    [
        (Opcode.TAKE, {"constant": 1}, r"instruction 0 must be take, address \d+, constant 0, target \d+ for .*"),
        (
            Opcode.GIVE,
            {"opcode": Opcode.MULTIPLY},
            r"instruction \d+ must be give, address \d+, constant \d+, target 0 for .*",
        ),
    ],
)
def test_a_wrong_field_is_named(opcode: Opcode, field: dict[str, int], sentence: str) -> None:
    core = small(INSTRUMENT)
    number = number_of(core, opcode)
    text = changed(core, number, encoded(core.program.instructions[number]._replace(**field), core.program))
    with pytest.raises(RejectedError, match=rf"^{sentence}$"):
        core.check(text)


def test_nothing_that_is_added_as_it_is_may_be_left_out() -> None:
    """One of them is what a counter counts by: of the node with it, the sum without it lacks just a 1."""
    core = small(PLAIN)
    graph = joined(core.certificate)
    added = [k for k, i in enumerate(core.program.instructions) if (i.opcode, i.constant) == (Opcode.MULTIPLY, 1)]
    assert len(added) == 2
    for number in added:
        without = encoded(core.program.instructions[number]._replace(constant=0), core.program)
        run = _Run(read_program(changed(core, number, without), core.certificate.name), graph, core.certificate)
        with pytest.raises(RejectedError, match=r"^instruction"):
            run.all()


def test_a_word_that_is_read_right_after_it_is_stored() -> None:
    core = small(PLAIN)
    program = read_program(core.text, core.certificate.name)
    numbers = [k for k, one in enumerate(program.instructions) if one.end == "finish" and k + 4 < len(program.codes)]
    assert any(k & 4 for k in numbers)  # so that the number and what is added to it have a digit in common
    for number in numbers:
        for later in range(number + 1, number + 4):
            early = core.program.instructions[later]._replace(
                opcode=Opcode.MULTIPLY, address=core.program.instructions[number].target, constant=3
            )
            changes = (*program.codes[:later], encoded(early, core.program), *program.codes[later + 1 :])
            sentence = (
                rf"^instruction {later} \(.*\) must (read its word 4 or more instructions after it is stored, not "
                rf"{later - number}|take digit 0 of the sample, which must be taken first)$"
            )
            with pytest.raises(RejectedError, match=sentence):
                _check_order(replace(program, codes=changes))


def test_a_program_that_is_one_bit_away_is_found() -> None:
    core = small(PLAIN)
    program, graph = read_program(core.text, core.certificate.name), joined(core.certificate)
    states = dict.fromkeys(graph.delays, 0)
    results = [graph.step(row, states) for row in samples(core.certificate, 30)]

    def found(code: int) -> list[tuple[int, int]]:
        wrong = replace(program, codes=(*program.codes[:3], code, *program.codes[4:]))
        return list(one_bit_away(wrong, core.certificate, results, []))

    top = 1 << program.code_bits - 4
    assert found(program.codes[3] ^ top) == [(3, program.codes[3])]
    assert found(program.codes[3] ^ top ^ top >> 4) == []
    assert found(program.codes[3]) == []


def test_what_is_taken_is_one_digit_of_an_input() -> None:
    core = small(PLAIN)
    run = _Run(read_program(core.text, core.certificate.name), joined(core.certificate), core.certificate)
    code = [("s_axis_tdata", k) for k in range(8)]
    (x,) = (scaled(run._of[node], run._frac(node)) for node in run.graph.inputs)
    whole = run._taken(0, [*code, *[code[7]] * 8])
    assert (whole.form, whole.low, whole.high) == (x, -128, 127)
    upper = run._taken(0, [0, 0, *code[3:], code[7]])
    assert (upper.form, upper.low, upper.high) == (scaled(run._forms.floor(scaled(x, -3)), 2), -64, 60)
    lower = run._taken(0, [0, *code[1:3], 0, 0])
    floors = [run._forms.floor(scaled(x, -k)) for k in (1, 3)]
    assert (lower.form, lower.low, lower.high) == (scaled(plus(floors[0], floors[1], -4), 1), 0, 6)
    assert run._taken(0, [0, 0]).form == {}
    sentence = r"^instruction 0 .* must take a digit of an input, not bits of several$"
    for wrong in ([*code[:3], code[0]], code[:3], [*code[:3], 0, code[3]], [code[1], code[0], 0], [*code, code[6]]):
        with pytest.raises(RejectedError, match=sentence):
            run._taken(0, wrong)


@pytest.mark.parametrize(("low", "high"), [(-128, 0), (-65, 0), (0, 127), (0, 64)])
def test_a_result_without_room_for_what_it_is(low: int, high: int) -> None:
    core = small(PLAIN)
    program, graph = read_program(core.text, core.certificate.name), joined(core.certificate)
    node = graph.nodes[graph.output]
    other = replace(node, entry=node.entry.model_copy(update={"low": low, "high": high}))
    nodes = (*graph.nodes[: graph.output], other, *graph.nodes[graph.output + 1 :])
    run = _Run(replace(program, results=(7,)), replace(graph, nodes=nodes), core.certificate)
    sentence = rf"^the result must have room for node \d+ \(.*\) of output_stage, in {low}\.\.{high}, not 7 bits$"
    with pytest.raises(RejectedError, match=sentence):
        run._check_result()


def test_the_word_that_holds_1_adds_just_the_constant() -> None:
    core = small(PLAIN)
    run = _Run(read_program(core.text, core.certificate.name), joined(core.certificate), core.certificate)
    for factor in (-5, 7):
        run._add(run._words[-1], constant(factor), (factor, factor))
    assert (run._acc.total, run._acc.low, run._acc.high) == (constant(2), 2, 2)
    base = 1 << run.program.digit_bits
    assert run._forms.extent(run._operand.form) == (run._operand.low, run._operand.high) == (-base, base - 1)


def test_an_opcode_that_does_not_exist() -> None:
    core = small(PLAIN)
    with pytest.raises(RejectedError, match=r"^instruction 3 must have an opcode below 13, not 14$"):
        core.check(changed(core, 3, 14))


def test_a_word_that_is_not_cleared() -> None:
    core = small(PLAIN)
    first = "".join(f"    words0[{address}] = 16'h{value:04x};\n" for address, value in enumerate((0, 0, 5)))
    text, count = re.subn(r"( {4}for \(i = )0(; i < \d+; i = i \+ 1\) words0\[i\] = )", rf"{first}\g<1>3\2", core.text)
    assert count == 1
    with pytest.raises(RejectedError, match=r"^word 2 must hold 0 before the first sample, not 5$"):
        core.check(text)


@pytest.mark.parametrize(("begin", "end"), [("/*", "*/"), ("`ifdef NEVER", "`endif")])
def test_words_that_are_hidden_do_not_count(begin: str, end: str) -> None:
    """The hardware would have what follows, which is spaced in another way; the words that are right are hidden."""
    core = small(PLAIN)
    words = dict(re.findall(r"instructions\[([23])\] = (\S+);", core.text))
    right, wrong = rf"instructions[2] = {words['2']};", rf"instructions[2]  =  {words['3']};"
    assert right in core.text
    hidden = core.text.replace(right, f"{wrong}\n{begin}\n{right}\n{end}\n")
    with pytest.raises(RejectedError, match=r"^the SystemVerilog must be made of its plain subset, not have "):
        core.check(hidden)
    assert core.check(f"// `sosmith verify` repeats it.\n{core.text}") == core.check()


def test_other_limits_of_the_calibration() -> None:
    core = small(INSTRUMENT)
    sentence = r"^the program must judge voltage by the codes 5\.\.4000, not 0\.\.4095$"
    with pytest.raises(RejectedError, match=sentence):
        check_program(core.text, core.certificate, calibrated=[(5, 4000), (0, 1023)])
    with pytest.raises(ValueError, match=r"^zip\(\) argument 3 is shorter than arguments 1-2$"):
        check_program(core.text, core.certificate, calibrated=[(0, 4095)])


def test_the_limits_of_the_calibration_are_read() -> None:
    spec = specified(INSTRUMENT)
    design = design_core(spec, realization="df1")
    inside = replace(design.datapath, calibrated=((5, 4000), (0, 900)))
    core = made(replace(design, quantized=replace(design.quantized, datapath=inside)), "folded")
    assert core.check().judged == ((5, 4000), (0, 900))
    sentence = r"^instruction \d+ \(judge, .*\) must judge voltage by the codes 6\.\.4000, not 5\.\.4000$"
    with pytest.raises(RejectedError, match=sentence):
        check_program(core.text, core.certificate, calibrated=[(6, 4000), (0, 900)])


def test_cores_without_a_fixed_program_are_refused() -> None:
    core = small(PLAIN)
    with pytest.raises(RejectedError, match=r"^the core must be folded or serial to have a program, not parallel$"):
        core.check("module plain(aclk);\n  input aclk;\nendmodule\n")
    loadable = ARCHITECTURES["folded"](core.design.datapath, reload=True)
    text = to_verilog(to_rtlil(loadable.component(), "plain"))
    with pytest.raises(RejectedError, match=r"^the program must be fixed to be checked, not loadable at run time$"):
        core.check(text)


# Edits of one bit.

USES_TARGET = EARLY_WRITES | LATE_WRITES
"""Opcodes that use their target; GIVE does as well if the result has several parts."""


def edited(core: Made, number: int, bit: int) -> tuple[str, Instruction, str]:
    """Flip a bit; return the text, the instruction as hardware takes it, and the field of the bit."""
    width, bits = core.program.digit_bits + 1, address_bits(core.program)
    code = encoded(core.program.instructions[number], core.program) ^ 1 << bit
    field = "opcode" if bit < 4 else "address" if bit < 4 + bits else "target" if bit < 4 + 2 * bits else "constant"
    value = code >> (4 + 2 * bits)
    value -= value >> (width - 1) << width
    opcode = Opcode(code & 15) if code & 15 < len(Opcode) else Opcode.MULTIPLY
    if opcode is Opcode.TAKE:
        value = min(value % 256, sum(location.digits for location in core.program.inputs) - 1)
    address, target = (code >> start & ((1 << bits) - 1) for start in (4, 4 + bits))
    if opcode is Opcode.GIVE and core.program.output.parts == 1:
        target = 0
    return changed(core, number, code), Instruction(opcode, address, value, target), field


def computed(core: Made, program: Program, codes: Sequence[Sequence[int]]) -> object:
    """Return what the integer model of a program makes of samples: codes and flags, or why it cannot run."""
    graph = core.design.datapath.stages[0].graph
    words = program.reset()
    try:
        return [program.step(row, words, [graph.nodes[i].frac for i in graph.inputs]) for row in codes]
    except (OverflowError, ValueError) as error:  # a sum that is too large, or an instruction with no such target
        return str(error)


def harmless(core: Made, number: int, new: Instruction, field: str, bit: int) -> str:
    """Say why an edit that was accepted changes nothing; nothing if there is no reason."""
    old = core.program.instructions[number]
    if field == "target" and old.opcode not in USES_TARGET:
        return "unused field"
    if old.opcode in PRODUCTS and field == "constant":
        return "unused field"
    if old.opcode is Opcode.TAKE and (field == "address" or bit >= 4 + 2 * address_bits(core.program) + 8):
        return "unused field"
    if not old.constant and old.opcode not in {*PRODUCTS, Opcode.MOVE, Opcode.OPERAND} and field == "address":
        return "another word times zero"
    if not old.constant and old.opcode is new.opcode is Opcode.MULTIPLY:
        return "nothing becomes an addition of zero"
    if not old.constant and old.opcode is Opcode.MULTIPLY and new.opcode in {Opcode.OPERAND, Opcode.MOVE}:
        return "nothing becomes a read that nothing uses"
    if old.opcode is Opcode.MULTIPLY and new.opcode in {Opcode.OPERAND, Opcode.MOVE}:
        return "a product whose word also goes where nothing reads it"
    if old.opcode is new.opcode and field == "address":
        return "another word with the same digit"
    if old.opcode is new.opcode and old.opcode in LATE_WRITES and field == "target":
        return "stored where nothing else is kept"
    if old.opcode is new.opcode and old.opcode in EARLY_WRITES and field == "target":
        return "stored where nothing else is kept"
    return ""


def rejection(core: Made, text: str) -> str:
    """Return the sentence of a rejection; nothing if a text is accepted."""
    try:
        core.check(text)
    except RejectedError as error:
        return str(error)
    return ""


def sweep(core: Made, edits: int, seed: int) -> Counter[str]:
    """Flip bits at random; check what is accepted against the integer model, and what is rejected for its sentence."""
    rng, numbers = random.Random(seed), np.random.default_rng(seed)
    ports = core.design.datapath.inputs
    codes = np.stack([numbers.integers(p.lowest, p.highest + 1, 80) for p in ports], axis=1).tolist()
    right = computed(core, core.program, codes)
    found: Counter[str] = Counter()
    for _ in range(edits):
        number, bit = rng.randrange(len(core.program.instructions)), rng.randrange(instruction_bits(core.program))
        text, new, field = edited(core, number, bit)
        instructions = (*core.program.instructions[:number], new, *core.program.instructions[number + 1 :])
        same = computed(core, replace(core.program, instructions=instructions), codes) == right
        sentence = rejection(core, text)
        edit = number, core.program.instructions[number], new, sentence
        if sentence:
            named = re.search(rf"\binstruction {number}\b", sentence) is not None
            assert re.search(r"\binstruction\b|^the program must ", sentence), edit
            found["rejected"] += 1
            found["rejected for another instruction"] += not (same or named)
            found["rejected without a difference in the run"] += same
        else:
            why = harmless(core, number, new, field, bit)
            assert same, edit
            assert why, edit
            found["accepted"] += 1
            found[f"accepted: {why}"] += 1
    return found


@pytest.mark.slow
def test_a_hundred_edits() -> None:
    found = sweep(small(PLAIN), 100, seed=1)
    assert found["accepted"] + found["rejected"] == 100
    assert found["rejected"] > 30
    assert found["rejected for another instruction"] == 0
    assert found["accepted: unused field"] > 5


@pytest.mark.slow
def test_edits_of_a_section_that_does_nothing() -> None:
    found = sweep(small(NOTHING.replace('"zero"', '"steady"')), 100, seed=3)
    assert found["rejected"] > 50


@pytest.mark.slow
@pytest.mark.parametrize("architecture", ["folded", "serial"])
@pytest.mark.parametrize("realization", ["df1_ef1", "df2t", "state_space"])
def test_a_thousand_edits(realization: str, architecture: str) -> None:
    found = sweep(small(INSTRUMENT, architecture, realization), 150, seed=2)
    # What is wrong in a recursion may show first in what was stored before.
    assert found["rejected for another instruction"] <= 3
    assert found["accepted"] + found["rejected"] == 150
    assert found["rejected"] > 50
