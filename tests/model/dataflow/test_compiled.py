"""The C model of a datapath is compiled once for one text, and two of it keep apart."""

import subprocess
from dataclasses import replace
from unittest.mock import patch

import numpy as np
import pytest
from tests.formal.small import leaky

from sosmith.model.dataflow import compiled
from sosmith.model.dataflow.compiled import compile_block
from sosmith.model.errors import ToolError


def test_one_text_is_compiled_once() -> None:
    compiled._built.cache_clear()
    datapath = leaky()
    with patch.object(subprocess, "run", wraps=subprocess.run) as run:
        first, second = compile_block.__wrapped__(datapath), compile_block.__wrapped__(leaky())
        assert run.call_count == 1
        compile_block.__wrapped__(replace(datapath, name="another"))
        assert run.call_count == 2
    codes = np.random.default_rng(1).integers(-2, 2, (12, 2, 1))
    wanted, _ = first(codes)
    half, _ = second(codes[:6])
    assert np.array_equal(half, wanted[:6])
    assert np.array_equal(first(codes)[0], wanted)


def test_a_compiler_that_has_gone_is_missed(monkeypatch: pytest.MonkeyPatch) -> None:
    compile_block.__wrapped__(leaky())
    monkeypatch.setenv("PATH", "/nowhere")
    with pytest.raises(ToolError, match=r"^a C compiler is needed for the bit-true model, and none was found: "):
        compile_block.__wrapped__(leaky())
