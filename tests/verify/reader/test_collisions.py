"""With ``no_rw_check``, a memory may read anything at the clock at which that word is written: nobody looks at it."""

import re

import pytest
from tests.verify.parallel.cores import Made
from tests.verify.parallel.cores import small as parallel

from sosmith.verify.graph import RejectedError
from sosmith.verify.reader.source import read_source

MARK = "  (* no_rw_check = 32'd1 *)\n"


def marked(core: Made, memory: str) -> str:
    text, count = re.subn(rf"^(?=  reg .*\b{memory} \[)", MARK, core.text, count=1, flags=re.MULTILINE)
    assert count == 1
    return text


def test_what_is_marked_is_read() -> None:
    text = marked(parallel(channels=3), "x1_memory")
    (module,) = (module for module in read_source(text, "plain").modules.values() if module.unchecked)
    assert module.unchecked == {"x1_memory"}
    assert not any(module.unchecked for module in read_source(parallel(channels=3).text, "plain").modules.values())


@pytest.mark.sweep(1)
@pytest.mark.parametrize("memory", ["v1_memory", "x1_memory", "x2_memory"])
def test_a_state_that_is_read_as_it_is_written_must_not_be_marked(memory: str) -> None:
    """Which states these are depends on the schedule: x1 takes over its input at once."""
    core = parallel(channels=3)
    if memory != "x1_memory":
        assert core.check(marked(core, memory)) == core.check()
        return
    sentence = r".*x1_memory must hold .* before the clock at which it is written, or not be marked with no_rw_check$"
    with pytest.raises(RejectedError, match=sentence):
        core.check(marked(core, memory))


@pytest.mark.slow
def test_the_memories_of_many_channels_are_marked_and_right() -> None:
    core = parallel(channels=40)
    assert MARK in core.text
    assert core.check().memories == 5
