"""The unit that runs a program: proven from the text, rejected when it does anything else."""

from __future__ import annotations

import re
from collections import Counter

import pytest
from tests.verify.parallel.edits import random_edits, swept
from tests.verify.small_specifications import INSTRUMENT, PLAIN, STEADY, STEADY_INSTRUMENT, WIDE
from tests.verify.unit.units import SEVERAL, WORN, Unit, unit

from sosmith.hdl.plan.folded_clocks import cycles_per_sample, latency_cycles, reset_cycles
from sosmith.verify.graph import RejectedError

# What the generator writes is accepted.


@pytest.mark.sweep(2)
@pytest.mark.parametrize(
    ("spec", "architecture", "channels", "products"),
    [
        (STEADY, "folded", 1, 1),
        (STEADY, "serial", 1, 1),
        (INSTRUMENT, "folded", 1, 1),
        (STEADY_INSTRUMENT + WORN, "serial", 2, 1),
        (SEVERAL, "folded", 3, 1),
        (STEADY, "folded", 1, 2),
        (INSTRUMENT, "folded", 1, 2),
        (SEVERAL, "folded", 3, 2),
    ],
    ids=["folded", "serial", "settling", "wear", "several limits", "two products", "two, settling", "two, limits"],
)
def test_small_cores(spec: str, architecture: str, channels: int, products: int) -> None:
    core = unit(spec, architecture, channels, products=products)
    found, program = core.check(), core.core.program
    assert found.states > len(program.instructions)
    serial = architecture == "serial"
    assert found.progress.cleared == reset_cycles(program, channels)
    assert found.pace.latency == latency_cycles(program, serial=serial)
    assert found.pace.interval == cycles_per_sample(program, serial=serial, channels=channels)


@pytest.mark.sweep(1)
@pytest.mark.parametrize("architecture", ["folded", "serial"])
def test_words_in_slices(architecture: str) -> None:
    core = unit(STEADY, architecture, 24)
    assert len(re.findall(r"reg \[\d+:0\] words\d+ \[", core.text)) > 1
    assert core.check().cases > 20


@pytest.mark.slow
@pytest.mark.parametrize("channels", [1, 2, 5])
@pytest.mark.parametrize(("architecture", "products"), [("folded", 1), ("folded", 2), ("serial", 1)])
@pytest.mark.parametrize("realization", ["df1", "df1_ef2", "df2t", "delta", "state_space"])
@pytest.mark.parametrize("spec", [PLAIN, STEADY_INSTRUMENT, WIDE], ids=["plain", "instrument", "wide"])
def test_every_realization(spec: str, realization: str, architecture: str, channels: int, products: int) -> None:
    core = unit(spec, architecture, channels, realization, products)
    assert core.check().cases > 20
    assert core.core.check().instructions == len(core.core.program.instructions)


TWO_BREAKS = {
    "a narrower sum": (
        r"\+ \$signed\(second_product\);",
        r"+ $signed(second_product[30:0]);",
        "products must be as asked after a clock, not another value",
    ),
    "no sign of the second factor": (
        r"\$signed\(second_data\) \* \$signed\(second_factor\)",
        r"second_data * second_factor",
        "second_product must be as asked after a clock, not another value",
    ),
    "the words the other way round": (
        r"assign second_read = (\w+);",
        r"assign second_read = \g<1>_2;",
        r"words0 must be read at \d+ at instruction \d+, not \d+|second_read must be read from .*",
    ),
    "the first word twice": (
        r"assign instruction2_second_address = instruction2\[\d+:\d+\];",
        r"assign instruction2_second_address = instruction2[7:4];",
        r"words0 must be read at \d+ at instruction \d+, not \d+",
    ),
    "another second constant": (
        r"second_factor <= [^;]+;",
        "second_factor <= second_data;",
        r"second_factor must be constant -?\d+ after a clock, not another value",
    ),
    "a word that passes too fast": (
        r"else moved <= passed5;",
        r"else moved <= passed4;",
        "moved must be as asked after a clock, not another value",
    ),
    "a word that is moved without an instruction": (
        r"assign moves = valid6 & instruction6_moves;",
        r"assign moves = instruction6_moves;",
        r"words0 must be written \d times at instruction \d+|valid1 must be .*",
    ),
}


@pytest.mark.parametrize("change", TWO_BREAKS)
def test_what_is_not_a_unit_with_two_products_is_rejected(change: str) -> None:
    core, (old, new, sentence) = unit(STEADY, products=2), TWO_BREAKS[change]
    wrong, count = re.subn(old, new, core.text)
    assert count == 1
    with pytest.raises(RejectedError, match=f"^(?:{sentence})$"):
        core.check(wrong)


# What is not the unit is rejected.

FOLDED_BREAKS = {
    "a narrower adder": (
        r"assign \{ added_wide\[32\], added \} = \$signed\((.*)\) \+ \$signed\(product\);",
        r"assign { added_wide[32], added } = $signed(\1) + $signed(product[30:0]);",
        "added must be the sum before and the product, not another value",
    ),
    "no sign of the product": (
        r"\+ \$signed\(product\);",
        r"+ $signed({ 1'h0, product[30:0] });",
        "added must be the sum before and the product, not another value",
    ),
    "no sign of a factor": (
        r"\$signed\(data\) \* \$signed\(factor\)",
        r"data * factor",
        "product must be as asked after a clock, not another value",
    ),
    "no sign of what is carried": (
        r"(assign total\[31:8\] = carried \? )\{ total_high\[23\], ",
        r"\1{ 1'h0, ",
        "added must be the sum before and the product, not another value",
    ),
    "a write that is missing": (
        r"assign moves_or_stores = moves \| stores;",
        r"assign moves_or_stores = stores;",
        "words0 must be written 1 times at instruction 4",
    ),
    "a write at one clock too many": (
        r"assign stores = valid5 & instruction5_stores;",
        r"assign stores = instruction5_stores;",
        "valid1 must be 0 while words are cleared",
    ),
    "a write at one place of the program": (
        r"assign stores = valid5 & instruction5_stores;",
        r"assign stores = valid5 & instruction5_finishes;",
        r"words0 must be written \d times at instruction \d+",
    ),
    "another word": (
        r"(assign instruction4_target = instruction4)\[11:8\]",
        r"\1[7:4]",
        r"words0 must be written at \d+ at instruction \d+, not \d+",
    ),
    "another word read": (
        r"assign instruction2_address = instruction2\[7:4\];",
        r"assign instruction2_address = instruction3[7:4];",
        r"words0 must be read at \d+ at instruction \d+, not \d+",
    ),
    "a counter that skips": (
        r"assign counter_plus_1_2 = counter \+ 1'h1;",
        r"assign counter_plus_1_2 = counter + 2'h2;",
        r"instructions_read_data must be .*|instructions_read must be instruction 1 .* at instruction 2",
    ),
    "a counter that begins elsewhere": (
        r"(assign counter_\w+ = counter\[4\] \? )5'h00",
        r"\g<1>5'h01",
        r"instructions_read must be instruction 0 .* at instruction 1",
    ),
    "a program that is too short": (
        r"assign is_last_instruction = counter == 5'h19;",
        r"assign is_last_instruction = counter == 5'h18;",
        r"the unit must not wait at instruction 25 while something is added up|.*instruction 25.*",
    ),
    "a limit": (
        r"\? 10'h07f : given0;",
        r"? 10'h07e : given0;",
        "m_axis_tdata must be the result, not another value",
    ),
    "a limit at another bit": (
        r"assign any_given0_8_7 = \| given0\[8:7\];",
        r"assign any_given0_8_7 = | given0[8:6];",
        "m_axis_tdata must be the result, not another value",
    ),
    "a flag of the limit": (
        r"assign output_saturated = below \| above;",
        r"assign output_saturated = above;",
        "bit 2 of m_axis_tuser must be output_saturated, not another value",
    ),
    "a rail": (
        r"& s_axis_tdata\[6:0\]",
        r"& s_axis_tdata[6:1]",
        "rail must be inputs after a clock, not another value",
    ),
    "a rail of another sample": (
        r"if \(taken\) rail <=",
        r"if (valid5) rail <=",
        r"rail must be (?:keep|inputs) after a clock, not another value",
    ),
    "a flag that is not kept": (
        r"if \(ends\) judged <= \{ 1'h0, rail \};",
        r"judged <= { 1'h0, rail };",
        "judged must be keep after a clock, not another value",
    ),
    "a stall that goes on": (
        r"assign not_waits_for_sink = ~ waits_for_sink;",
        r"assign not_waits_for_sink = 1'h1;",
        r"a result must not be overwritten at instruction \d+ before it leaves",
    ),
    "a result that does not wait": (
        r"assign leaves = m_axis_tvalid & m_axis_tready;",
        r"assign leaves = m_axis_tvalid;",
        r"m_axis_tvalid must be 1 at instruction \d+",
    ),
    "a result that is not kept": (
        r"if \(given0_load\) given0 <= added\[9:0\];",
        r"if (valid5) given0 <= added[9:0];",
        "given0 must be keep after a clock, not another value",
    ),
    "a result too narrow": (
        r"given0 <= added\[9:0\];",
        r"given0 <= { added[8], added[8:0] };",
        "given0 must be added after a clock, not another value",
    ),
    "a sample accepted early": (
        r"else taken <= taken_next;",
        r"else taken <= start;",
        r"a sample must not be accepted before its digits are taken, as it is at instruction \d+",
    ),
    "a sample never taken": (
        r"assign start = s_axis_tvalid & not_busy_or_clearing;",
        r"assign start = 1'h0;",
        "a sample must be taken and its result leave within some number of clocks",
    ),
    "a sample never accepted": (
        r"else taken <= taken_next;",
        r"else taken <= 1'h0;",
        r"a sample must be begun at instruction 0 only if there is one that has not been begun",
    ),
    "a start without a sample": (
        r"assign start = s_axis_tvalid & not_busy_or_clearing;",
        r"assign start = not_busy_or_clearing;",
        r"a sample must be begun at instruction 0 only if there is one that has not been begun",
    ),
    "words that are not cleared": (
        r"(assign counter_\w+ = counter)\[4\](?= \?)",
        r"\1[3]",
        r"words0\[\d+\] must be \d after a reset, not None",
    ),
    "a word that is not 1": (
        r"assign all_instruction5_target = & instruction5_target;",
        r"assign all_instruction5_target = & instruction5_target[3:1];",
        r"words0\[14\] must be 0 after a reset, not 1",
    ),
    "a valid bit without its reset": (
        r"if \(rst\) valid3 <= 1'h0;\n *else valid3 <= valid2;",
        r"valid3 <= valid2;",
        r"valid3 must be 0 while words are cleared",
    ),
    "an operand that is not kept": (
        r"if \(\w+\) operand <= read;",
        r"operand <= read;",
        "operand must be keep after a clock, not another value",
    ),
    "a word beside the one read": (
        r"assign read = words0_read;",
        r"assign read = { words0_read[15:1], words0_read[1] };",
        "read must be the word read, not another value",
    ),
    "a digit moved": (
        r"(assign \w+ = instruction3_is_take \? \{ .*)s_axis_tdata( \})",
        r"\g<1>s_axis_tdata[6:0], s_axis_tdata[7]\2",
        r"instruction 0 \(take, .*\) must take a digit of an input, not bits of several",
    ),
}

SERIAL_BREAKS = {
    "an end too early": (
        r"assign any_left_15_1 = \| left\[15:1\];",
        r"assign any_left_15_1 = | left[15:2];",
        "done must be 0 while there are digits left",
    ),
    "no end at a sign": (
        r"assign done = left_is_65535 \| not_any_left_15_1;",
        r"assign done = not_any_left_15_1;",
        "done must be 1 while nothing but a sign is left",
    ),
    "no subtraction": (
        r"\} = left_is_65535_2 \? (\w+) : (\w+);",
        r"} = \2;",
        "added must be the sum before and the product, not another value",
    ),
    "no shift": (
        r"(assign \w+ = advance \? .* : )\{ shifted\[30:0\], 1'h0 \};",
        r"\1shifted;",
        "shifted must be shift after a clock, not another value",
    ),
    "a sign lost": (
        r"(assign \w+ = advance \? chosen : )\{ left\[15\], left\[15:1\] \};",
        r"\1{ left[15], 1'h0, left[14:1] };",
        "left must be shift after a clock, not another value",
    ),
    "a stage that does not wait": (
        r"if \(advance\) instruction2 <= instructions_read_data;",
        r"instruction2 <= instructions_read_data;",
        r"instruction2 must be instruction \d+ .* at instruction \d+",
    ),
    "a word that does not wait": (
        r"if \(advance\) begin\n( *words0_read <= words0.*)\n *end",
        r"if (valid2) begin\n\1\n    end",
        r"words0 must be read just when the pipeline moves, at instruction \d+",
    ),
    "a result in the middle": (
        r"if \(given0_load\) given0",
        r"if (valid3) given0",
        "given0 must be keep after a clock, not another value",
    ),
}


def _named(core: Unit, old: str, new: str, sentence: str) -> None:
    text, count = re.subn(old, new, core.text)
    assert count >= 1
    said = core.rejection(text)
    assert re.fullmatch(sentence, said), said


@pytest.mark.sweep(20)
@pytest.mark.parametrize("kind", FOLDED_BREAKS)
def test_each_break_of_a_folded_unit_is_named(kind: str) -> None:
    _named(unit(STEADY), *FOLDED_BREAKS[kind])


@pytest.mark.parametrize("kind", SERIAL_BREAKS)
def test_each_break_of_a_serial_unit_is_named(kind: str) -> None:
    _named(unit(STEADY, "serial"), *SERIAL_BREAKS[kind])


FLAG_BREAKS = {
    "a limit of wear": (
        r"wear_limits\[1\] = \d+'h(\w+)\w;",
        r"wear_limits[1] = 24'h\g<1>1;",
        "wear_limits must hold the .*",
    ),
    "limits of another channel": (
        r"wear_limits\[channel\]",
        "wear_limits[limited[1:0]]",
        "wear_limits must be read .*",
    ),
    "wear that is above its limit": (r"(assign reached_warning = .*) >= ", r"\1 > ", "bit 3 of m_axis_tuser must .*"),
    "no wear": (r"(assign reached_limit = ).*;", r"\g<1>1'h0;", "bit 4 of m_axis_tuser must be wear_critical, .*"),
    "another channel": (
        r"(assign m_axis_tdest = )\{ 6'h00, channel \};",
        r"\1s_axis_tdest;",
        "m_axis_tdest must be .*",
    ),
    "a channel that does not stay": (
        r"else if \(channel_load\) channel <=",
        "else channel <=",
        "bits of x must not be used",
    ),
    "bits of another channel": (
        r"start \? s_axis_tdest\[1:0\]",
        "start ? s_axis_tdest[2:1]",
        "channel must be that of .*",
    ),
    "words of another channel": (r"words0\[\{ channel, ", "words0[{ s_axis_tdata[1:0], ", "words0 must be used for .*"),
    "a channel too many": (
        r"s_axis_tdest < 2'h3",
        "s_axis_tdest <= 2'h3",
        "valid1 must not depend on data at instruction 0",
    ),
}


@pytest.mark.parametrize("kind", FLAG_BREAKS)
def test_each_break_of_flags_and_channels_is_named(kind: str) -> None:
    _named(unit(SEVERAL, "folded", 3), *FLAG_BREAKS[kind])


def test_a_flag_that_the_program_judges_is_that_of_its_sample() -> None:
    """It is followed through all states: taken over a clock early, it would be that of the sample before."""
    core = unit(PLAIN)
    text, count = re.subn(
        r"if \(ends\) judged <= \{ settling, ", "if (m_axis_tvalid) judged <= { settling, ", core.text
    )
    assert count == 1
    assert core.rejection(text) == "judged must be copy after a clock, not another value"
    text, count = re.subn(r"(if \(\w+\)) settling <= added\[\d+\];", r"\1 settling <= added[3];", core.text)
    assert count == 1
    assert core.rejection(text) == "settling must be judge after a clock, not another value"


def _swept(core: Unit, count: int, seed: int, clocks: int) -> Counter[str]:
    """Edit at random, but for the program: what is accepted must be the same in simulation, or only slower."""
    words = re.compile(r" *(instructions|words\d+)\[\d+\] = ")
    edited = (each for each in random_edits(core.text, count, seed) if not words.match(each[2][0]))
    pace = core.check().pace

    def rejection(text: str) -> str:
        said = core.rejection(text)
        return said or ("" if core.check(text).pace == pace else "the clocks must be others")

    return swept(edited, rejection, lambda text: core.seen(text, clocks, seed), core.text)


@pytest.mark.slow
def test_four_edits() -> None:
    found = _swept(unit(STEADY), 4, seed=1, clocks=80)
    assert found["rejected"] + found["accepted"] > 2


@pytest.mark.slow
@pytest.mark.parametrize(
    ("spec", "architecture", "channels"),
    [(STEADY, "folded", 1), (PLAIN, "serial", 1), (SEVERAL, "folded", 3), (STEADY_INSTRUMENT + WORN, "serial", 2)],
)
def test_a_hundred_edits(spec: str, architecture: str, channels: int) -> None:
    found = _swept(unit(spec, architecture, channels), 100, seed=2, clocks=1500)
    assert found["rejected"] > 2 * found["accepted"] > 0


def test_a_text_without_a_unit_is_refused() -> None:
    core = unit(STEADY)
    with pytest.raises(RejectedError, match=r"^the unit must have a register instruction4$"):
        core.check(core.text.replace("instruction4", "instruction9"))
