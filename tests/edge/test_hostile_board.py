"""Boards and hosts that lie to them: the answers of docs/protocol.md, and a client that was written from that page."""

from __future__ import annotations

import json
import os
from pathlib import Path

import numpy as np
import pytest

from tests.edge import document_client as page
from tests.edge.document_client import Frames
from tests.edge.hostile_board import line_of, to_model, to_netlist
from tests.host.lines import plain_device
from tests.host.ports import plugged
from tests.interface.small import filter_design


@pytest.mark.parametrize("seed", range(4))
def test_the_model_answers_as_the_document_says(seed: int) -> None:
    answered = to_model(seed, 250)
    assert answered.findings == ()
    assert answered.messages > 150


def test_the_example_of_the_document() -> None:
    """The frames of the page are those that the client of the page makes."""
    assert page.frame(3, 5, b"\0\x12\0\x34").hex(" ").upper() == "00 03 03 05 02 12 06 34 D6 DF A0 C1 00"
    assert page.frame(page.OPEN, 0).hex(" ").upper() == "00 02 01 05 BE 23 C2 58 00"
    assert Frames().feed(bytes.fromhex("00 02 81 03 01 04 05 0C C1 0A 2F 00")) == [(0x81, 0, b"\1\4\0")]
    assert page.unstuffed(page.stuffed(bytes(range(248)))) == bytes(range(248))


def test_a_client_that_knows_only_the_document() -> None:
    """Identity and samples, in numbers of the page alone, over a pseudo-terminal."""
    with plugged(plain_device()) as port:
        handle, read = line_of(port)
        frames, number = Frames(), 200

        def ask(kind: int, body: bytes = b"") -> bytes:
            nonlocal number
            number = (number + 1) % 256
            os.write(handle, page.frame(kind, number, body))
            while True:
                for found in frames.feed(read(60.0)):
                    assert isinstance(found, tuple)
                    assert found[:2] == (kind | 0x80, number)
                    assert found[2][-1] == page.OK
                    return found[2][:-1]

        assert ask(page.OPEN)[0] == 1
        text = b""
        while b"\0" not in text:
            text += ask(page.IDENTITY, bytes([len(text) // 64]))
        about = json.loads(text.split(b"\0")[0])
        codes = np.random.default_rng(1).integers(-512, 512, 6 * about["samples"])
        results = b""
        for start in range(0, len(codes), about["samples"]):
            part = codes[start : start + about["samples"]]
            results += ask(page.SAMPLES, b"\0" + part.astype("<i2").tobytes())
        assert ask(page.COUNTERS) == bytes(8)
        os.close(handle)
    rows = np.frombuffer(results, np.dtype([("code", "<i2"), ("flags", "u1")]))
    assert rows["code"].tolist() == filter_design().core.datapath.compute(codes[:, np.newaxis]).tolist()


@pytest.mark.slow
def test_the_hardware_answers_as_the_document_says(tmp_path: Path) -> None:
    answered = to_netlist(tmp_path, 1, 300)
    assert answered.findings == ()
    assert answered.messages > 200
