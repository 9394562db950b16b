"""Names for reading: nets and modules say what they are, and with `keep` they stay through synthesis."""

import re
from functools import cache
from pathlib import Path

import pytest
from tests.gen.designs import example_design, parallel_design
from tests.verify.small_specifications import STEADY

from sosmith.gen.core import CoreDesign, design_core
from sosmith.gen.fpga.yosys import run_yosys
from sosmith.gen.output.generate import generated
from sosmith.gen.output.naming.net_names import plain_names
from sosmith.gen.output.naming.rtlil_names import with_kept_names, with_named_ports, without_second_names
from sosmith.gen.output.verilog import core_texts
from sosmith.gen.specification.specification import from_text
from sosmith.verify.graph import RejectedError
from sosmith.verify.reader.inlined import FUNCTIONS
from sosmith.verify.reader.rtlil.kept import check_kept
from sosmith.verify.reader.source import read_source

GLUE = 10
"""Nets of a core without protection that nothing in our source, and no few words, can name, at most."""


def designed(kind: str) -> CoreDesign:
    return example_design("audio_lowpass.toml") if kind == "folded" else parallel_design("audio_lowpass.toml")


@cache
def written(kind: str) -> str:
    design = designed(kind)
    return generated(design)[f"{design.spec.name}.sv"]


@cache
def kept(architecture: str, *, keep: bool = True) -> dict[str, str]:
    options = f'hardware.architecture = "{architecture}"\nhardware.keep = {str(keep).lower()}\n'
    return generated(design_core(from_text(STEADY + options, Path("spec.toml"))))


@pytest.mark.sweep(1)
@pytest.mark.parametrize("kind", ["parallel", "folded"])
def test_nets_have_names_but_for_some_glue(kind: str) -> None:
    source = read_source(written(kind)).modules
    names = [name for module in source.values() for name in module.widths if not name.startswith("?")]
    assert all(re.fullmatch(r"[A-Za-z]\w*", name) for name in names)
    nameless = [name for name in names if re.fullmatch(r"n\d+(_\d+)?|port_\d+_\d+", name)]
    assert len(nameless) <= GLUE < len(names) / 10


@pytest.mark.slow
@pytest.mark.parametrize("protect", ["detect", "correct"])
def test_a_check_bit_is_one_parity(protect: str) -> None:
    """Not a chain of nets, each with a bit more."""
    options = f'hardware.architecture = "parallel"\nhardware.protect = "{protect}"\n'
    design = design_core(from_text("channels = 4\n" + STEADY + options, Path("spec.toml")))
    text = generated(design)[f"{design.spec.name}.sv"]
    nets = [name for module in read_source(text).modules.values() for name in module.widths]
    assert len([name for name in nets if re.search(r"_part(_\d+)?$|^n\d+$", name)]) < len(nets) / 4


def test_each_stage_has_its_module_with_its_comment() -> None:
    design, text = designed("parallel"), written("parallel")
    for stage in design.datapath.stages:
        assert re.search(rf"^// .*\n(?://.*\n)*module \w+_{stage.name}\(", text, re.MULTILINE)
    (module,) = re.findall(r"^module \w+_section0\(.*?^endmodule$", text, re.MULTILINE | re.DOTALL)
    for net in ("x", "product_A1", "v1"):
        assert re.search(
            rf"^  // {net}: U?Q-?\d+\.\d+, .*\n  (?:input|wire|reg) \[\d+:0\] {net}\b", module, re.MULTILINE
        )


def test_each_function_has_its_module_with_its_comment() -> None:
    text = written("folded")
    for name in FUNCTIONS:
        assert re.search(rf"^// {name}: .*\n(?://.*\n)+module audio_lowpass_{name}\(", text, re.MULTILINE)
    program = designed("folded").architecture.program
    assert program is not None
    assert f"// program_memory: {len(program.instructions)} instructions;" in text
    states = [location for location in program.locations if location.is_state]
    assert len(re.findall(r"^//   words? [\d, to]+: \w+\.\w+, frac \d+$", text, re.MULTILINE)) == len(states)


def test_names_say_what_a_net_is_for_or_computes() -> None:
    text = r"""module top(a);
  reg busy = 1'h0;
  wire \$1 ;
  wire \$2 ;
  wire \$3 ;
  wire \$4 ;
  wire [8:0] \$5 ;
  wire \$6 ;
  assign \$1  = ~ ready;
  assign \$2  = valid & \$1 ;
  assign \$3  = count == 8'h1f;
  assign \$4  = \$2  ? \$6  : 1'h1;
  assign \$6  = { a, b } != 2'h0;
  assign { \$5 [8], sum } = a + b;
  assign \$5 [7:0] = sum;
  always_ff @(posedge clk)
    if (\$3 ) busy <= \$4 ;
endmodule"""
    found = plain_names(text)
    assert re.findall(r"assign (.*) = ", found) == [
        "not_ready",
        "valid_and_not_ready",
        "busy_load",
        "busy_next",
        "busy_next_part",
        "{ sum_wide[8], sum }",
        "sum_wide[7:0]",
    ]
    assert "if (busy_load) busy <= busy_next;" in found


INNER = r"""
module \top

  attribute \init 1'0
  wire width 1 \state

  wire width 1 \again

  wire width 4 \word
  cell \inner \inner
    connect \port$3$0 \word [3:0]
    connect \port$4$0 \word [1:0]
    connect \o $1 [0]
  end
connect \again \state [0]
end
module \inner

  wire width 4 input 0 \port$3$0

  wire width 2 input 1 \port$4$0

  wire width 1 output 2 \o
end
"""


def test_a_port_has_the_name_of_the_net_outside() -> None:
    found = with_named_ports(INNER)
    assert re.findall(r"connect \\(\S+) \\word", found) == ["word", "word_1_0"]
    assert re.findall(r"put \d \\(\S+)", found) == ["word", "word_1_0", "o"]


PASSED = r"""
module \top

  wire width 4 \word
  cell \middle \middle
    connect \port$3$0 \word [3:0]
  end
end
module \middle

  wire width 4 input 0 \port$3$0

  cell \inner \inner
    connect \port$3$0 \port$3$0 [3:0]
  end
end
module \inner

  wire width 4 input 0 \port$3$0

  wire width 4 output 1 \word
end
"""


def test_ports_that_are_called_the_same_in_two_modules_may_get_two_names() -> None:
    """The one inside has an output with the name of the net outside."""
    found = with_named_ports(PASSED)
    assert re.findall(r"put \d \\(\S+)", found) == ["word", "port$3$0", "word"]
    assert re.findall(r"connect \\(\S+) \\(\S+)", found) == [("word", "word"), ("port$3$0", "word")]


def test_a_net_has_no_second_name() -> None:
    found = without_second_names(INNER)
    assert "\\again" not in found
    assert found.replace("  wire width 1 \\again\n\n", "") == found
    kept_again = INNER.replace("  wire width 1 \\again", "  attribute \\keep 1\n  wire width 1 \\again")
    assert without_second_names(kept_again) == kept_again


def test_wires_are_kept_but_not_ports_and_registers() -> None:
    found = with_kept_names(INNER)
    assert re.findall(r"attribute \\keep 1\n  wire width \d+ \\(\w+)", found) == ["again", "word"]


def synthesized(text: str, folder: Path) -> set[str]:
    """Return the names of all wires that are left of a core."""
    (folder / "plain.sv").write_text(text)
    script = "read_verilog -sv plain.sv; synth -noabc -flatten -top plain; opt_clean -purge; write_rtlil plain.il"
    run_yosys(script, folder)
    return set(re.findall(r"^  wire .*\\(\S+)$", (folder / "plain.il").read_text(), re.MULTILINE))


@pytest.mark.slow
@pytest.mark.parametrize("architecture", [pytest.param("parallel", marks=pytest.mark.slow), "folded"])
def test_kept_nets_stay_through_synthesis(architecture: str, tmp_path: Path) -> None:
    modules = read_source(kept(architecture)["plain.sv"]).modules
    instances = {kind: f"{name}." for kind, name, _ in modules["plain"].instances}
    wanted = {f"{instances.get(kind, '')}{net}" for kind, module in modules.items() for net in module.kept}
    assert len(wanted) > 20
    assert wanted <= synthesized(kept(architecture)["plain.sv"], tmp_path)
    assert not wanted <= synthesized(kept(architecture, keep=False)["plain.sv"], tmp_path)


def test_the_verifier_holds_what_is_kept() -> None:
    files, plain = kept("folded"), kept("folded", keep=False)
    modules = read_source(files["plain.sv"]).modules
    check_kept(files["plain.il"], modules, asked=True)
    check_kept(plain["plain.il"], read_source(plain["plain.sv"]).modules, asked=False)
    with pytest.raises(RejectedError, match=r"^\w+ of plain must be kept, as specified$"):
        check_kept(plain["plain.il"], read_source(plain["plain.sv"]).modules, asked=True)
    with pytest.raises(RejectedError, match=r"^\w+ of plain\w* must be kept, as in the RTLIL$"):
        check_kept(files["plain.il"], read_source(plain["plain.sv"]).modules, asked=True)
    with pytest.raises(RejectedError, match=r"^\w+ of plain\w* must not be kept, as in the RTLIL$"):
        check_kept(plain["plain.il"], modules, asked=False)


@pytest.mark.parametrize(
    ("right", "wrong", "sentence"),
    [
        (
            "  wire start;",
            "  (* dont_touch = 32'd1 *)\n  wire start;",
            r"line \d+ must be an attribute .*",
        ),
        ("  wire start;", "  (* keep = 32'd0 *)\n  wire start;", r"the SystemVerilog must be made of its plain .*"),
        (
            "  reg busy ",
            "  (* keep = 32'd1 *)\n  reg busy ",
            r"line \d+ must be an attribute .*",
        ),
        ("  wire rst;", "  (* keep = 32'd1 *)\n  wire rst;", r"rst must be no port to be kept"),
    ],
)
def test_no_other_attribute_and_none_elsewhere(right: str, wrong: str, sentence: str) -> None:
    text = kept("folded", keep=False)["plain.sv"]
    assert right in text
    head, _, rest = text.rpartition(right)
    with pytest.raises(RejectedError, match=f"^{sentence}$"):
        read_source(head + wrong + rest)


def test_without_keep_the_texts_say_nothing_of_it() -> None:
    text = STEADY + 'hardware.architecture = "folded"\n'
    design = design_core(from_text(text, Path("spec.toml")))
    assert "keep" not in core_texts(design)[1]
    assert '"keep"' not in generated(design)["plain.certificate.json"]
    assert '"keep": true' in kept("folded")["plain.certificate.json"]


def test_the_document_shows_what_is_written() -> None:
    document = (Path(__file__).parents[4] / "docs" / "hardware.md").read_text()
    excerpts = re.findall(r"```systemverilog\n(.*?)```", document, re.DOTALL)
    assert len(excerpts) == 2
    for kind, excerpt in zip(("folded", "parallel"), excerpts, strict=True):
        assert f"{excerpt}module " in written(kind)
