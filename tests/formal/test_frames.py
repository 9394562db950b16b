"""The receiver of frames: no message is overwritten before it is released, whatever comes over the line."""

from pathlib import Path

import pytest
from amaranth.hdl import Assert, Assume, Module
from tests.formal.prover import Proof, broken, prove

from sosmith.hdl.bus import frame_receiver
from sosmith.model.link.protocol import MAX_MESSAGE


class Kept(Proof):
    """No message is overwritten before it is released, and none gets longer than a message may be."""

    def state(self, m: Module) -> None:
        """Relate the buffer that is written to the one that is read."""
        d, inside = self.design, self.inside
        held, slot, first, index = (inside[name] for name in ("held", "slot", "first", "index"))
        m.d.comb += Assume(d.o_full | ~d.i_release)
        with m.If(self.started):
            m.d.comb += [
                Assert(held != 3),
                Assert((slot ^ first) == held[0]),
                Assert(index <= MAX_MESSAGE),
                Assert(~(inside["stores"] & held[1])),
            ]


def test_no_message_is_overwritten(tmp_path: Path) -> None:
    assert prove(Kept(frame_receiver.FrameReceiver()), tmp_path) == "PASS"


@pytest.mark.slow
@pytest.mark.parametrize(
    ("right", "wrong"),
    [
        ("dropped.eq(held[1])", "dropped.eq(0)"),  # a third message
        ("slot.eq(slot ^ accepted)", "slot.eq(slot ^ begun)"),  # a dropped one takes a buffer
        ("index.eq(index + (index != MAX_MESSAGE))", "index.eq(index + 1)"),  # a message without an end
    ],
)
def test_a_broken_receiver_of_frames_is_found_out(right: str, wrong: str, tmp_path: Path) -> None:
    module = broken(frame_receiver, right, wrong)
    assert prove(Kept(module.FrameReceiver()), tmp_path) == "FAIL"
