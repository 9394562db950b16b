"""What is accepted as a C model, and what is refused: constants, operations, order, and what else a compiler reads."""

from __future__ import annotations

import random
import re
from collections.abc import Callable
from functools import cache
from typing import NamedTuple

import pytest
from tests.gen.word_lengths.decimated import small
from tests.verify.small_specifications import INSTRUMENT, STEADY, WIDE

from sosmith.gen.core import CoreDesign, design_core
from sosmith.gen.output.certificate import about, certificate
from sosmith.gen.specification.specification import load
from sosmith.model.dataflow.c_model import c_header, c_source
from sosmith.verify.c_model.check import ModelVerdict, check_c_model
from sosmith.verify.c_model.tokens import tokens_of
from sosmith.verify.certificate_file import Certificate
from sosmith.verify.graph import RejectedError

POINTS = [(v, t) for v in (1.5, 3.25, 4.5, 6.0, 8.5) for t in (20.0, 41.5, 60.0, 97.0)]
MEASURED = "clearance_mm,voltage_V,temperature_C\n" + "".join(f"{round(1.2 + 0.4 * v, 4)},{v},{t}\n" for v, t in POINTS)
FIXED = 'hardware.realization = "df1_ef1"\nhardware.architecture = "parallel"\n'
TEXTS = {
    "measured": re.sub("calibration.coefficients = .*", 'calibration.data = "m.csv"', INSTRUMENT),
    "worn": INSTRUMENT + "wear = { initial = 1.0, warning = 2.5, limit = 3.0 }\n",
    "channels": INSTRUMENT.replace("sample_rate", "channels = 2\nsample_rate", 1)
    + "wear = { initial = [1.0, 2.0], warning = 2.5, limit = 3.0 }\n",
    "steady": STEADY,
    "delta": STEADY.replace("bits = 8", "bits = 24"),
    "cascade": STEADY.replace("bits = 8", "bits = 16").replace("order = 2", "order = 5"),
    "split": STEADY.replace("bits = 8", "bits = 24").replace(
        "order = 2, cutoff = 20.0", "order = 4, cutoff = 10.41667"
    ),
    "taken": """
name = "taken"
sample_rate = 100.0
input.x = { bits = 8, signed = true, range = [-1.0, 1.0] }
filter = { family = "bessel", kind = "lowpass", method = "impulse_invariant", order = 3, cutoff = 6.5728888 }
output = { bits = 21, signed = true, range = [-1.0, 1.0], unit = "", max_error = 1.9073486328125e-06 }
""",
    "ring": """
name = "ring"
sample_rate = 100.0
input.x = { bits = 8, signed = true, range = [-1.0, 1.0] }
filter = { taps = [0.25, 0.5, 0.25, -0.125] }
output = { bits = 10, signed = true, range = [-2.0, 2.0] }
""",
    "wide": WIDE.replace("bits = 12", "bits = 32").replace("bits = 24", "bits = 32").replace("0.0005", '"faithful"'),
}
REALIZATIONS = {"ring": "fir_direct", "delta": "delta", "split": "df1", "taken": "df1_ef2", "wide": "df1_ef2"}


class Model(NamedTuple):
    source: str
    header: str
    certificate: Certificate

    def check(self, source: str | None = None, header: str | None = None) -> ModelVerdict:
        found = self.certificate.about
        assert found is not None
        assert found.item is not None
        return check_c_model(source or self.source, header or self.header, self.certificate, found.item)


def of(made: CoreDesign) -> Model:
    entries = certificate(made.quantized, made.spec.max_error, about(made, {}))
    return Model(c_source(made.datapath), c_header(made.datapath), entries)


@pytest.fixture(scope="module")
def model(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], Model]:
    folder = tmp_path_factory.mktemp("model")
    (folder / "m.csv").write_text(MEASURED, encoding="utf-8")

    @cache
    def made(name: str) -> Model:
        if name == "decimated":
            return of(small())
        path = folder / f"{name}.toml"
        words = FIXED.replace("df1_ef1", REALIZATIONS.get(name, "df1_ef1"))
        text = TEXTS[name]
        words = words.replace("parallel", "folded") if name in {"ring", "cascade"} else words
        text = text.replace("\n[filter]", f"\n{words}[filter]") if "[filter]" in text else text + words
        path.write_text(text, encoding="utf-8")
        return of(design_core(load(path)))

    return made


@pytest.mark.sweep(5)
@pytest.mark.parametrize("name", [*TEXTS, "decimated"])
def test_what_is_written_is_proven(name: str, model: Callable[[str], Model]) -> None:
    found = model(name).check()
    assert found.nodes > 10
    if name == "wide":
        assert "__int128" in model(name).source
    for each in re.findall(r"const \w+ (n\d+_\w+) = ", model(name).source):
        assert len(re.findall(rf"\b{each}\b", model(name).source)) > 1  # or a compiler warns
    if name == "split":  # a product in two parts, which add up to more than it on the way
        assert re.search(r"n1_\d+s\d+ = ", model(name).source)
        assert not re.search(r"n2_\d+s\d+ = ", model(name).source)
    if name == "cascade":
        assert {"product", "state->s0", "w->n1_3"} <= set(re.findall(r"product|(?:state|w)->\w+", model(name).source))
        assert re.search(r"= \(int32_t\)\(n2_\d+s\d+ >> 32\);", model(name).source)
    if name == "measured":
        assert re.search(r"voltage_code < \d+ ", model(name).source)
    if name == "worn":
        assert "< 0) << 5" in model(name).source


BODY = "{\n    const int32_t n0_0"
EDITS = [
    ("worn", r"INT32_C\((\d+)\)", r"INT32_C(1\1)", "wrong constant"),
    ("worn", r">> (\d+);", r">> 1\1;", "wrong shift"),
    ("worn", r" > INT32_C\(\d+\) \? INT32_C\(\d+\) :", " > INT32_C(9) ? INT32_C(9) :", "another clamp"),
    ("worn", r"(n\d+_\d+) < INT32_C\(0\) \? .*?;", r"\1;", "no clamp"),
    ("worn", r" \+ ", " - ", "another operation"),
    ("worn", r"(n\d+_\d+) \* (INT32_C\(\d+\));", r"\2 / \1;", "a division by a variable"),
    ("worn", r"(const int32_t n0_1 = )w->temperature_code", r"\1w->voltage_code", "another input"),
    ("worn", r"const int32_t n0_0 = w->voltage_code;", "const int32_t n0_0 = w->temperature_code;", "swapped input"),
    ("worn", r"w->n0_0 = n0_0;", "w->n0_0 = n0_1;", "another node handed on"),
    ("worn", r"state->s0 = n(\d)_\d+;", r"state->s0 = n\1_1;", "another state"),
    ("worn", r"    state->s0 = n\d+_\d+;\n", "", "a state that stays"),
    ("worn", r"(    state->s0 = n\d+_\d+;\n)", r"\1\1", "a state stored twice"),
    ("worn", r"state->s1\b", "state->s0", "a state of two"),
    ("worn", r"state->s0\b", "state->s99", "a state beyond the end"),
    ("worn", re.escape(BODY), "{\n    w->n0_0 = 0;\n    const int32_t n0_0", "an extra statement"),
    ("worn", re.escape(BODY), "{\n    for (;;) {}\n    const int32_t n0_0", "no end"),
    ("worn", r"    w\.voltage_code = \(int32_t\)voltage_code;\n", "", "an input not set"),
    ("worn", r"    stage1\(state, &w\);\n", "", "a stage left out"),
    ("worn", r"(    stage1\(state, &w\);\n)(    stage2\(state, &w\);\n)", r"\2\1", "stages in another order"),
    ("worn", r"voltage_code == 0 \|\| ", "", "a rail forgotten"),
    ("measured", r"voltage_code < (\d+)", r"voltage_code < 1\1", "another calibrated range"),
    ("worn", r"\) << 2", ") << 3", "another flag"),
    ("worn", r"limits\[1\]\[2\] = \{\{896", "limits[1][2] = {{897", "another warning"),
    ("worn", r"code >= limit\[1\]", "code > limit[1]", "a limit passed later"),
    ("worn", r"\(\(code >= limit\[0\]\)", "(0", "no warning"),
    ("worn", r" \? 0 : worn", " ? 0 : 0", ""),
    ("ring", r"k < 3;", "k < 2;", "a ring filled too seldom"),
    ("ring", r"        return;\n", "        ;\n", "a ring filled again with each sample"),
    ("ring", r"    state->started = 1;\n", "", "a start that is not kept"),
    ("ring", r"    fill\(state, x_code\);\n", "", "a first sample that fills nothing"),
    ("ring", r"fill\(&states\[c\], in\[at \+ c\]\)", "fill(&states[c], in[at])", "a ring filled from another channel"),
    ("cascade", r"const int64_t (n\d+_\d+)s(\d+) =", r"const int64_t \1s1\2 =", "another power of two"),
    ("cascade", r"const int64_t (n\d+_\d+)s\d+ =", r"const int64_t \1 =", "no power of two"),
    ("cascade", r"s(\d+) >> 32", r"s\1 >> 31", "a floor of one bit more"),
    ("cascade", r"upper \* INT64_C\(4294967296\)", "upper * INT64_C(8589934592)", "another power in the function"),
    ("cascade", r" \* INT64_C\((\d+)\) \+ \(", r" * INT64_C(1\1) + (", "another factor of the upper word"),
    ("cascade", r"product\((n\d+_\d+), INT32_C\((\d+)\)\)", r"product(\1, INT32_C(\2) + \1)", "another product"),
    ("cascade", r"product\((n\d+_\d+), ", r"product((int64_t)\1, ", "a factor of 64 bits"),
    ("cascade", r"product\((n\d+_\d+), (INT32_C\(\d+\))\)", r"product(\1)", "a product of one"),
    ("cascade", r"upper_a \* lower_b", "upper_a * lower_a", "another function"),
    ("cascade", r"\+ \(first >> 16\)", "", "a carry forgotten"),
    ("cascade", r"\(int64_t\)a \* b", "a * b", "a product that overflows"),
    ("cascade", r"__thumb2__", "__thumb__", "a function that has no else"),
    ("cascade", r"(const int32_t n2_1 = )w->n1_3", r"\1w->n1_17", "an output for that of a sample earlier"),
    ("cascade", r"(const int32_t n2_1 = )w->n1_3", r"\1w->n0_5", "what a stage further up hands on"),
    ("cascade", r"(const int32_t n3_2 = )w->n2_6", r"\1w->n2_5", "an earlier sample for another"),
    ("cascade", r"state->s4 = n2_5;", "state->s4 = n2_27;", "a word of another sample"),
    ("cascade", r"state->s4 = n2_5;", "state->s4 = n2_6;", "a word that is never filled"),
    ("cascade", r"state->s0 = n0_8;", "state->s0 = n0_2;", "a word that is not 0 at the start"),
    ("cascade", r"= state->s2;", "= state->s2 + INT32_C(1);", "more than a word"),
    ("cascade", r"    const int32_t n2_8 = .*\n", "", "a node that is used and not computed"),
    ("cascade", r"(    const int32_t n2_8 = .*\n)", r"\1\1", "a node twice"),
    ("cascade", r"const int32_t n2_8 = ", "const int32_t n1_8 = ", "a node of another stage"),
    ("cascade", r"const int32_t n2_8 = ", "const int32_t n2_999 = ", "a node beyond the end"),
    ("worn", r"behind = (\d+)", r"behind = 1\1", "another delay between the stages"),
    ("worn", r"first <= 1 && 1 <= last", "first <= 1 && 1 < last", "a stage that stops early"),
    ("worn", r"n \+ 4 <= samples", "n + 3 <= samples", "a sample too many"),
    ("worn", r"memset\(state, 0", "memset(state, 1", "another reset"),
    ("worn", r"64 \+ 16384 / channels", "0", "no progress"),
    ("worn", r"typedef struct \{\n", "typedef struct __attribute__((packed)) {\n", "attributes"),
    ("worn", r"int32_t n0_0;\n", "int32_t n0_0;\n    int32_t n0_0;\n", "a member twice"),
    ("worn", r"int32_t n0_0;\n", "int32_t n0_0;\n    int32_t other;\n", "a member of nobody"),
    ("wide", r"const int64_t (n\d+_\d+) ", r"const int32_t \1 ", "a narrow type"),
    ("wide", r"= (n\d+_\d+) >> (\d+);", r"= (int32_t)(\1 >> \2) * INT32_C(1);", "a conversion on the way"),
    ("worn", r"const int32_t n0_1 ", "int32_t n0_1 ", "a variable that could change"),
    ("worn", r"(void worn_reset)", r"static int unused(void) { return 1; }\n\1", ""),
    ("worn", r"\Z", "static int unused(void) { return 1; }\n", "a function that nobody calls"),
    ("worn", r"\Z", "#undef INT64_C\n", "a macro behind"),
    ("worn", r"#include <string.h>", "#include <string.h>\n#define int64_t short", "a macro of a type"),
    ("worn", r"#include <string.h>", "#define memset(a, b, c)\n#include <string.h>", "a macro of a function"),
    ("worn", r"#include <string.h>", '#include "string.h"', "another file"),
    ("worn", r"#include <string.h>", "#include <string.h>\n#pragma GCC optimize 3", "a pragma"),
    ("worn", r"(    w->n0_0 = n0_0;)", r'    _Pragma("once")\n\1', "a pragma inside"),
    ("worn", r"define ALWAYS_INLINE inline$", "define ALWAYS_INLINE inline register", "a macro with more"),
    ("worn", r"#endif\n", "#endif /* x\n */\n", "a comment over the end of a directive"),
    ("worn", r"(    w->n0_0 = n0_0;)", r"    // ??/\n\1", "a trigraph"),
    ("worn", r"(    w->n0_0 = n0_0;)", r"    // \\\n\1", "a line splice"),
    ("worn", r"(    w->n0_0 = n0_0;)", r"    /* \\\n */\n\1", "a splice in a comment"),
    ("worn", r"(    w->n0_0 = n0_0;)", r"    /* *??/\n/ w->n0_0 = 1; */\n\1", "a trigraph in a comment"),
    ("worn", r"(    w->n0_0 = n0_0;)", r"    /* /* */\n\1", "a comment in a comment"),
    ("worn", r"(    w->n0_0 = n0_0;)", r"    // x\n\1", "a comment of one line"),
    ("worn", r"(    w->n0_0 = n0_0;)", r"\r\1", "a carriage return"),
    ("worn", r"(    w->n0_0 = n0_0;)", r"\f\1", "a form feed"),
    ("worn", r"\[(\d+)\]", r"<:\1:>", "digraphs"),
    ("worn", r"INT32_C\((\d+)\)", r"INT32_C(0\1)", "an octal number"),
    ("worn", r"INT32_C\((\d+)\)", r"\1.0", "a floating-point number"),
    ("worn", r"w->n0_0 = n0_0;", "w->n0_0 = n0_0, w->n0_0;", "a comma"),
    ("worn", r"\(void\)state;", "(void)(state->s0 = 1);", "a statement that does something"),
    ("worn", r"static const size_t behind", "static size_t behind", "a delay that could change"),
    ("channels", r"limits\[channel\]", "limits[0]", "limits of another channel"),
    ("channels", r"wear_flags\(channel, \(int64_t\)", "wear_flags(0, (int64_t)", "flags of another channel"),
    ("channels", r"step\(&local, c, ", "step(&local, 0, ", "another channel in a block"),
    ("wide", r"__int128", "int64_t", "too narrow a type"),
    ("wide", r"\(__int128\)", "(int64_t)", "too narrow a cast"),
    ("decimated", r"integrate\(state, code\);\n    state", "state", "a sample forgotten"),
    ("decimated", r"k < 8", "k < 7", "a start that is too short"),
    ("decimated", r"value -= state->combs\[k\];", "value += state->combs[k];", "a sum for a difference"),
    ("decimated", r"comb\(state\) \+ \d+", "comb(state) + 0", "a rounding down"),
    ("decimated", r"\(state->phase \+ 1\) % 4", "(state->phase + 1) % 5", "another factor"),
    ("decimated", r"state->flags \|= flags & 0x03", "state->flags = flags & 0x03", "flags of the last sample alone"),
    ("decimated", r"ahead_stage0\(state, &w\);\n", "", "a stage before it left out"),
]  # fmt: skip


@pytest.mark.sweep(60)
@pytest.mark.parametrize(("name", "old", "new", "what"), [edit for edit in EDITS if edit[3]], ids=lambda each: None)
def test_what_computes_something_else_is_refused(
    name: str, old: str, new: str, what: str, model: Callable[[str], Model]
) -> None:
    text = model(name).source
    changed = re.sub(old, new, text, count=1, flags=re.MULTILINE)
    assert changed != text, what
    with pytest.raises(RejectedError):
        model(name).check(changed)


@pytest.mark.parametrize(
    ("old", "new"),
    [
        (r"int(?:32|64)_t (s\d+);", r"int \1;"),
        (r"(    int32_t s\d+;\n)", r"\1\1"),
        (r"(    int32_t s\d+;\n)", r"\1    int32_t s99;\n"),
        (r"    int32_t s\d+;\n", ""),
        (r"_H\n\n", "_H\n#define int64_t int\n"),
        (r"#ifndef ", "#ifdef "),
        (r"int64_t voltage_code, int64_t temperature_code", "int64_t temperature_code, int64_t voltage_code"),
        (r"uint8_t \*status\);", "uint8_t *status) __attribute__((const));"),
        (r'extern "C"', 'extern "D"'),
        (r"#include <stdint.h>", "#include <other.h>"),
        (r"\Z", "int more;\n"),
    ],
)
def test_another_header_is_refused(old: str, new: str, model: Callable[[str], Model]) -> None:
    header = model("worn").header
    changed = re.sub(old, new, header, count=1)
    assert changed != header
    with pytest.raises(RejectedError):
        model("worn").check(header=changed)


def test_a_state_that_does_not_hold_its_values_is_refused(model: Callable[[str], Model]) -> None:
    header = model("wide").header
    changed = re.sub(r"__int128 (s\d+);", r"int64_t \1;", header, count=1)
    assert changed != header
    with pytest.raises(RejectedError, match=r"^state \d+ must hold -?\d+\.\.\d+$"):
        model("wide").check(header=changed)


def test_the_sentence_says_where(model: Callable[[str], Model]) -> None:
    worn = model("worn")
    line = next(number for number, text in enumerate(worn.source.split("\n"), 1) if "memset(state, 0" in text)
    changed = worn.source.replace("memset(state, 0", "memset(state, 1", 1)
    with pytest.raises(RejectedError, match=rf"^line {line} of smooth.c must go on with 0, not with '1'$"):
        worn.check(changed)
    sentence = r"^n1_10 of the C model must compute node 10 \(bound taps_A1\) of section0, and computes something else$"
    cascade = model("cascade")
    changed = cascade.source.replace("const int32_t n1_10 = (n1_0 + n1_1)", "const int32_t n1_10 = (n1_0 - n1_1)")
    assert changed != cascade.source
    with pytest.raises(RejectedError, match=sentence):
        cascade.check(changed)
    sentence = r"^state 0 must be stored as it is read a sample later, and holds something else$"
    with pytest.raises(RejectedError, match=sentence):
        cascade.check(cascade.source.replace("state->s0 = n0_8;", "state->s0 = n0_5;"))


def test_comments_and_layout_are_free(model: Callable[[str], Model]) -> None:
    text = model("steady").source.replace(" = ", "\n  =\n").replace("/* section0 */", "/* a µm */")
    assert model("steady").check(re.sub("/\\*(?! else).*?\\*/", "", text)) == model("steady").check()


def test_products_commute(model: Callable[[str], Model]) -> None:
    text = re.sub(r"= (n\d+_\d+) \* (n\d+_\d+);", r"= \2 * \1;", model("worn").source)
    assert text != model("worn").source
    assert model("worn").check(text) == model("worn").check()


@pytest.mark.parametrize("name", ["voltage_code = 0, x", "a b", ""])
def test_names_of_inputs_are_plain(name: str, model: Callable[[str], Model]) -> None:
    worn = model("worn")
    inputs = (worn.certificate.inputs[0].model_copy(update={"name": name}), worn.certificate.inputs[1])
    forged = worn._replace(certificate=worn.certificate.model_copy(update={"inputs": inputs}))
    with pytest.raises(RejectedError, match=r"^the name of an input must be a plain identifier, not .*$"):
        forged.check(worn.source.replace("voltage_code", f"{name}_code"))


@pytest.mark.sweep(1)
@pytest.mark.parametrize("name", ["worn", "cascade", "decimated"])
def test_random_changes_of_tokens_are_refused(name: str, model: Callable[[str], Model]) -> None:
    """Numbers, marks and names change places at random, or go: nothing of the kind computes the same."""
    text, rng = model(name).source, random.Random(7)
    words = [
        match for match in re.finditer(r"\w+|[-+*/%&|<>=!?:;,.()\[\]{}]", text) if not in_comment(text, match.start())
    ]
    for _ in range(25):
        place, other = rng.choice(words), rng.choice(words)[0]
        if other == place[0] or {other, place[0]} <= {"__int128", "int64_t", "int32_t"}:
            continue
        new = rng.choice([other, ""])
        if place[0] in {"INT32_C", "INT64_C"} and not new:
            continue  # a small number is the same without
        changed = f"{text[: place.start()]} {new} {text[place.end() :]}"
        if tokens(changed) == tokens(text):
            continue
        with pytest.raises(RejectedError):
            model(name).check(changed)


def in_comment(text: str, place: int) -> bool:
    return text.rfind("/*", 0, place) > text.rfind("*/", 0, place)


def tokens(text: str) -> list[str]:
    try:
        return [token.text for token in tokens_of(text, "x")]
    except RejectedError:
        return []
