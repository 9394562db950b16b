"""What an outsider has to read of an exported theory: the final theorem, and the definitions that it rests on."""

import re

import pytest
from tests.gen.designs import EXAMPLES
from tests.verify.rocq.small import DECIMATED, SETTLING, designed

from sosmith.gen.core import design_core
from sosmith.gen.output.certificate import certificate
from sosmith.gen.specification.specification import load
from sosmith.verify.certificate_file import Certificate
from sosmith.verify.rocq.check import rocq_texts

LIMIT = 300


def definitions(text: str) -> dict[str, str]:
    """Return the definitions of a theory by their names."""
    found = re.findall(r"^(Definition (\w+)\b.*?\.)$", text, re.DOTALL | re.MULTILINE)
    return {name: body for body, name in found}


def to_read(texts: dict[str, str], theorem: str) -> list[str]:
    """Return the parts of the certificate's theory that a theorem's statement needs, and the statement."""
    claims = texts["Claims.v"]
    match = re.search(rf"^Theorem {theorem} :.*?\.$", claims, re.DOTALL | re.MULTILINE)
    assert match is not None
    known = definitions(claims)
    parts, left = {theorem: match[0]}, [match[0]]
    while left:
        for word in re.findall(r"\w+", left.pop()):
            if word in known and word not in parts:
                parts[word] = known[word]
                left.append(known[word])
    return [*parts.values()]


def certified(name: str) -> Certificate:
    made = design_core(load(EXAMPLES / f"{name}.toml"))
    return certificate(made.quantized, made.spec.max_error)


@pytest.mark.parametrize("name", ["audio_lowpass", "flange_wear_bench"])
def test_the_final_theorem_is_short(name: str) -> None:
    texts = rocq_texts(certified(name))
    parts = to_read(texts, "error_is_bounded")
    names = {re.split(r"\W+", part, maxsplit=2)[1] for part in parts}
    assert {"error_is_bounded", "core", "ports", "calibrated", "exact_sections"} == names
    assert sum(text.count("\n") + 1 for text in (texts["Definitions.v"], *parts)) < LIMIT


@pytest.mark.parametrize("text", [DECIMATED, SETTLING])
def test_what_it_rests_on_needs_no_proof(text: str) -> None:
    texts = rocq_texts(designed(text))
    parts = to_read(texts, "error_is_bounded")
    assert sum(text.count("\n") + 1 for text in (texts["Definitions.v"], *parts)) < LIMIT
    general = re.sub(r"\(\*.*?\*\)", "", texts["Definitions.v"], flags=re.DOTALL)
    assert re.findall(r"\b(?:Lemma|Theorem|Proof|Axiom|Parameter|Hypothesis)\b", general) == []
    assert re.findall(r"^(?:From|Require)\b.*", general, re.MULTILINE) == [
        "Require Import ZArith Reals List. Import ListNotations. Open Scope Z_scope."
    ]


def test_what_folds_is_said_in_few_lines() -> None:
    texts = rocq_texts(designed(DECIMATED))
    parts = to_read(texts, "filter_folds")
    names = {re.split(r"\W+", part, maxsplit=2)[1] for part in parts}
    assert names == {"filter_folds", "decimator_", "exact_sections", "pass_edge", "passing_gains", "band_gains"}
    assert sum(text.count("\n") + 1 for text in (texts["Definitions.v"], *parts)) < LIMIT
