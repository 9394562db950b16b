"""Pairs of registers that hold a state of two channels are proven like a memory, and nothing else is taken for one."""

import re

import pytest
from tests.verify.parallel.cores import PLAIN, small
from tests.verify.parallel.rejections import rejection, sweep

BREAKS = {
    "a word is cleared with another value": (r"v1_word0 <= 25'h0000000;", "v1_word0 <= 25'h0000001;"),
    "both words are cleared at once": (r"assign v1_clear0 = clear & \w+;", "assign v1_clear0 = clear & clear;"),
    "the words are cleared by the channel of a sample": (
        r"assign v1_clear1 = clear & clear_channel;",
        "assign v1_clear1 = clear & channel2;",
    ),
    "the words are cleared at different clocks": (
        r"assign v1_clear1 = clear & clear_channel;",
        "assign v1_clear1 = advance & clear_channel;",
    ),
    "what is written counts while another word is cleared": (
        r"assign v1_write = (\w+) & \w+;",
        r"assign v1_write = \1 & \1;",
    ),
    "a word is written for the other channel": (r"v1_write0 = v1_write & \w+;", "v1_write0 = v1_write & channel2;"),
    "the words are written for different samples": (
        r"v1_write1 = v1_write & channel2",
        "v1_write1 = v1_write & channel1",
    ),
    "the words take over different values": (r"(v1_write1\) v1_word1 <=) v;", r"\1 v1;"),
    "a word is written before it is cleared": (
        r"if \(v1_clear1\) v1_word1 <= 25'h0000000;\n    else if \(v1_write1\) v1_word1 <= v;",
        "if (v1_write1) v1_word1 <= v;\n    else if (v1_clear1) v1_word1 <= 25'h0000000;",
    ),
    "the other word is read": (
        r"assign v1 = channel1 \? v1_word1 : v1_word0;",
        "assign v1 = channel1 ? v1_word0 : v1_word1;",
    ),
    "a word is read without its channel": (r"assign v1 = channel1 \? v1_word1 : v1_word0;", "assign v1 = v1_word0;"),
    "a word holds something at first": (r"reg \[24:0\] v1_word0 = 25'h0000000;", "reg [24:0] v1_word0 = 25'h0000001;"),
}


@pytest.mark.parametrize("kind", BREAKS)
def test_what_is_no_memory_of_two_words_is_rejected(kind: str) -> None:
    core = small(channels=2)
    old, new = BREAKS[kind]
    text, count = re.subn(old, new, core.text, count=1)
    assert count == 1
    sentence = rejection(core, text)
    if kind == "a word holds something at first":  # it is cleared before the first sample
        assert sentence == ""
    else:
        assert re.fullmatch(r"(section0\.v1\w*|section0\.\w+) must .+", sentence), sentence


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(3))
def test_edits_of_two_channels(seed: int) -> None:
    found = sweep(small(PLAIN, channels=2), 100, seed, clocks=400)
    assert found["accepted"] + found["rejected"] == 100
    assert found["rejected"] > 50
