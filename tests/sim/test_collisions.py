"""What a block RAM reads at the clock at which that word is written is anything: cores do not look at it."""

import re
from pathlib import Path

import pytest
from tests.sim.peers.peer_runs import expected, made_of, run, stimulus, words

from sosmith.gen.output.verilog import to_rtlil, to_verilog

_MEMORY = re.compile(
    r"\(\* no_rw_check = 32'd1 \*\)\s+(?:\(\* ram_style = \"block\" \*\)\s+)?reg (?:signed )?(?:\[(\d+):0\] )?(\S+) +\["
)


def spoilt(source: str, *, always: bool = False) -> str:
    """Invert what memories read at the clock at which that word is written; `always`: any of their words."""
    return "endmodule".join(_spoilt_module(module, always=always) for module in source.split("endmodule"))


def _spoilt_module(module: str, *, always: bool) -> str:
    for top, memory in _MEMORY.findall(module):
        name = re.escape(memory)
        write = re.search(rf"if \((.+)\)\s+{name} ?\[(.+)\] <= ", module)
        if write is None:
            continue  # a program that stays

        def inverted(read: re.Match[str], bits: int = int(top or 0) + 1, write: re.Match[str] = write) -> str:
            hit = write[1] if always else f"{write[1]} && {write[2]} == {read[2]}"
            return f"{read[1]} ^ {{{bits}{{{hit} }}}};"

        module, count = re.subn(rf"(\b\w+ <= {name} ?\[(.+)\]);", inverted, module)
        assert count == 1
    return module


@pytest.mark.slow
@pytest.mark.parametrize(
    ("architecture", "realization", "channels"),
    [("folded", "df1_ef2", 3), ("serial", "df2t", 3), ("parallel", "df1_ef2", 17), ("parallel", "delta", 17)],
)
def test_no_word_is_used_that_is_read_while_it_is_written(
    architecture: str, realization: str, channels: int, tmp_path: Path
) -> None:
    made = made_of(architecture, realization, channels)
    codes, order = stimulus(made, 8)
    source = to_verilog(to_rtlil(made.architecture.component(), made.datapath.name))
    assert _MEMORY.search(source)
    job = {"words": words(made, codes, order), "dest": True, "seed": 1}
    wanted = expected(made, codes, order)
    for always, equal in ((False, True), (True, False)):
        folder = tmp_path / str(always)
        folder.mkdir()
        assert (run(folder, spoilt(source, always=always), made.datapath.name, job) == wanted) is equal
