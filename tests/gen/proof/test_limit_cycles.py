"""Limit cycles and dead bands: bounds against exhaustive search, the certificate, and the figures of the theory."""

import math
import re
from collections.abc import Sequence
from fractions import Fraction

import numpy as np
import pytest
from click.testing import CliRunner
from scipy import signal
from tests.gen.designs import EXAMPLES, example_design
from tests.gen.proof.cycle_search import cycle_from, search_cycles

from sosmith.cli import cli
from sosmith.gen.output.core_facts import core_facts
from sosmith.gen.output.manifest import manifest
from sosmith.gen.proof.limit_cycles import (
    is_positive_definite,
    limit_cycles,
    loop_matrix,
    loop_states,
    lyapunov_diagonal,
    proves_decay,
)
from sosmith.gen.realizations.registry import CASCADES, REALIZATIONS, Row
from sosmith.gen.realizations.section_format import SectionFormat, unknown_range
from sosmith.model.dataflow.graph import Graph, GraphBuilder, value

SECTION: Row = tuple(signal.butter(2, 0.1)[0]) + tuple(signal.butter(2, 0.1)[1])
"""Low-pass at a twentieth of the sample rate, unity gain at zero frequency."""


def section_0() -> Row:
    """Sharpest section of the locomotive filter (THEORY section 0)."""
    u, c = 0.00813, 2 * math.sin(math.pi / 14)
    a0 = 1 + c * u + u * u
    g = u * u / a0
    return (g, 2 * g, g, 1.0, 2 * (u * u - 1) / a0, (1 - c * u + u * u) / a0)


def graph_of(realization: str, row: Row, bits: int = 24, x_frac: int = 0) -> Graph:
    """Section with every quantizer at whole LSBs."""
    form = SectionFormat(coefficient_bits=bits, x=unknown_range(x_frac), fracs={"v": 0} if x_frac else {})
    return REALIZATIONS[realization].build(row, form, "section").graph


def run_constant(graph: Graph, code: int, samples: int) -> list[float]:
    state = graph.reset()
    output = graph.nodes[graph.outputs[0]]
    return [float(value(output, graph.step([code], state)[0])) for _ in range(samples)]


@pytest.mark.parametrize(
    ("realization", "largest", "dead_band"), [("df1", 5519, 1898), ("df1_ef1", 88.7, 0), ("df1_ef2", 2.06, 0)]
)
def test_bounds_of_section_6(realization: str, largest: float, dead_band: float) -> None:
    found = limit_cycles(graph_of(realization, section_0()))
    assert float(found.largest) == pytest.approx(largest, rel=5e-4)
    assert float(found.dead_band) == pytest.approx(dead_band, rel=1e-4)
    assert (found.lyapunov, found.none) == (None, False)


def test_plain_direct_form_is_stuck() -> None:
    """THEORY section 6: cycles of more than 1871 LSB, and 1000.3 LSB of constant input that change nothing."""
    graph = graph_of("df1", section_0(), x_frac=10)
    one = 1 << graph.nodes[graph.delays[-1]].frac
    cycle = cycle_from(graph, [0, 0, 1898 * one, 1898 * one])
    assert cycle == [1898]
    assert cycle_from(graph, [0, 0, 1899 * one, 1899 * one]) != [1899]
    assert set(run_constant(graph, round(1000.3 * 1024), 3000)) == {0.0}
    rng = np.random.default_rng(1)
    for start in rng.integers(-5000, 5000, (5, 2)):
        (amplitude, *_) = cycle_from(graph, [0, 0, *(int(code) * one for code in start)])
        assert 0 < amplitude <= limit_cycles(graph).largest


@pytest.mark.slow
@pytest.mark.parametrize("realization", ["df1_ef1", "df1_ef2"])
@pytest.mark.parametrize("level", [1000.3, -7.5, 0.7])
def test_error_feedback_follows_a_constant(realization: str, level: float) -> None:
    """THEORY section 6: an error of at most 0.7 LSB."""
    graph = graph_of(realization, section_0(), x_frac=10)
    settled = run_constant(graph, round(level * 1024), 6000)[-1000:]
    assert max(abs(y - level) for y in settled) <= 0.7 + 1 / 1024


@pytest.mark.slow
@pytest.mark.parametrize("realization", ["df1_ef1", "df1_ef2"])
def test_error_feedback_comes_to_rest_within_an_lsb(realization: str) -> None:
    graph = graph_of(realization, section_0(), 8)
    one = 1 << graph.nodes[graph.delays[-1]].frac
    for start in np.random.default_rng(2).integers(-500, 500, (3, 2)):
        state = [0, 0, *(int(code) * one for code in start)]
        output = [graph.step([0], state)[0] for _ in range(6000)]
        assert set(output[-1000:]) <= {-1, 0, 1}


@pytest.mark.sweep(2)
@pytest.mark.parametrize("bits", [3, 5])
@pytest.mark.parametrize("realization", CASCADES)
def test_exhaustive_search_stays_within_the_bound(realization: str, bits: int) -> None:
    graph = graph_of(realization, SECTION, bits)
    told = limit_cycles(graph)
    found = search_cycles(graph, 12, fraction_bits=0)
    assert found.starts == 25 ** len(loop_states(graph))
    assert found.amplitude <= (0 if told.none else told.largest)


@pytest.mark.slow
def test_what_the_search_finds() -> None:
    """The dead band of a plain direct form holds whole LSBs up to its edge; truncated magnitudes hold none."""
    graph = graph_of("df1", SECTION, 5)
    found = search_cycles(graph, 12, fraction_bits=0)
    assert math.floor(limit_cycles(graph).dead_band) == 6
    assert found.amplitude == 6
    assert search_cycles(graph_of("normal", SECTION, 5), 40).amplitude == 0
    assert limit_cycles(graph_of("normal", SECTION, 5)).none


def rotation(kind: str) -> Graph:
    """Build a normal form, (7 x1 - 2 x2 + u, 2 x1 + 7 x2) / 8, with both states quantized to whole LSBs in some way."""
    g = GraphBuilder()
    wide = 1 << 60
    u = g.input("u", 0, -wide, wide)
    x1, x2 = (g.delay(name, 0, -wide, wide) for name in ("x1", "x2"))
    scaled = [[g.scale(x, factor, 3) for factor in (7, 2)] for x in (x1, x2)]
    sums = [
        g.add(g.subtract(scaled[0][0], scaled[1][1]), g.shift(u, -3)),
        g.add(scaled[0][1], g.floor(scaled[1][0], -1) if kind == "floored product" else scaled[1][0]),
    ]
    if kind == "offset":
        sums[1] = g.add(sums[1], g.constant(1, 1))
    for x, total in zip((x1, x2), sums, strict=True):
        rounding = kind == "rounded" or (kind == "one rounded" and x == x2)
        quantized = g.round(total, 0) if rounding else g.truncate(total, 0)
        g.connect(x, g.bound(quantized, -wide, wide, f"{g[x].name}_next"))
    return g.build([x1])


@pytest.mark.sweep(2)
@pytest.mark.parametrize(
    ("kind", "none"),
    [("truncated", True), ("rounded", False), ("one rounded", False), ("floored product", False), ("offset", False)],
)
def test_only_truncated_magnitudes_are_proven_to_rest(kind: str, none: bool) -> None:
    graph = rotation(kind)
    told, found = limit_cycles(graph), search_cycles(graph, 30)
    assert told.lyapunov == (1, 1)
    assert told.none == none
    assert (found.amplitude == 0) == none
    assert found.amplitude <= told.largest


def test_a_truncated_value_beside_a_state_is_not_proven_to_rest() -> None:
    """A state less its truncated half, ``s - trunc(s / 2)``, stays at one for ever."""
    g = GraphBuilder()
    wide = 1 << 60
    u, s = g.input("u", 0, -wide, wide), g.delay("s", 0, -wide, wide)
    total = g.add(g.subtract(s, g.truncate(g.scale(s, 1, 1), 0)), u)
    g.connect(s, g.bound(total, -wide, wide, "s_next"))
    graph = g.build([s])
    told = limit_cycles(graph)
    assert told.lyapunov == (1,)
    assert search_cycles(graph, 3, fraction_bits=0).amplitude == 1
    assert not told.none


@pytest.mark.parametrize("worst", ["high", "low"])
def test_constant_errors_add_up_at_their_worst_ends(worst: str) -> None:
    """Bits are dropped from ``u / 2`` and from ``u / 4``: the output is off by -1/2 to 3/4, or by -3/4 to 1/2."""
    g = GraphBuilder()
    u = g.input("u", 0, -8, 7)
    half, quarter = g.floor(g.shift(u, -1), 0), g.floor(g.shift(u, -2), 0)
    told = limit_cycles(g.build([g.subtract(half, quarter) if worst == "high" else g.subtract(quarter, half)]))
    assert told.dead_band == Fraction(3, 4)
    assert Fraction(3, 4) <= told.largest < Fraction(3, 4) + Fraction(1, 2**20)


def test_search_between_whole_lsbs() -> None:
    """Error feedback reads the bits below the LSB too: starts at every quarter, from -2 to 2."""
    graph = graph_of("df1_ef2", SECTION, 3)
    found = search_cycles(graph, 2, fraction_bits=2)
    assert found.starts == 17**2
    assert found.amplitude <= limit_cycles(graph).largest


def test_search_beyond_a_million_states_is_refused() -> None:
    message = "starts must be at most 1048576, not 1002003002001"
    with pytest.raises(ValueError, match=f"^{re.escape(message)}$"):
        search_cycles(graph_of("df1", SECTION), 500500, fraction_bits=0)


def test_states_outside_the_loop_do_not_count() -> None:
    """Direct form I: x(n-1) and x(n-2) are only remembered."""
    graph = graph_of("df1", SECTION)
    assert [graph.nodes[graph.delays[k]].name for k in loop_states(graph)] == ["v1", "v2"]
    a1, a2 = SECTION[4:]
    assert np.array(loop_matrix(graph), dtype=float) == pytest.approx(np.array([[-a1, -a2], [1, 0]]), abs=1e-6)


def exact(matrix: Sequence[Sequence[float]]) -> list[list[Fraction]]:
    return [[Fraction(entry) for entry in row] for row in matrix]


@pytest.mark.parametrize("size", [1, 2, 3, 5])
def test_definiteness_agrees_with_eigenvalues(size: int) -> None:
    rng = np.random.default_rng(size)
    seen = set()
    for _ in range(60):
        half = rng.integers(-3, 4, (size, size))
        matrix = half @ half.T + np.diag(rng.integers(-3, 3, size))
        lowest = np.linalg.eigvalsh(matrix).min()
        if abs(lowest) > 1e-9:
            seen.add(bool(lowest > 0))
            assert is_positive_definite(exact(matrix.tolist())) == (lowest > 0)
    assert seen == {True, False}


def test_a_semidefinite_matrix_is_not_definite() -> None:
    assert not is_positive_definite(exact([[1, 1], [1, 1]]))
    assert not is_positive_definite(exact([[0, 0], [0, 1]]))
    assert is_positive_definite(exact([[1, 1], [1, 1 + 2**-40]]))


def test_a_certificate_is_found_exactly_where_there_is_one() -> None:
    """Against a fine search over all ratios of the two weights, on random matrices on both sides of the condition."""
    rng = np.random.default_rng(7)
    ratios = np.exp(np.linspace(-12, 12, 1201))
    weights = np.stack([np.diag([1.0, ratio]) for ratio in ratios])
    seen = {True: 0, False: 0}
    for _ in range(300):
        matrix = rng.uniform(-1.3, 1.3, (2, 2))
        differences = weights - matrix.T @ weights @ matrix
        lowest = (np.linalg.eigvalsh(differences)[:, 0] / ratios).max()
        diagonal = lyapunov_diagonal(exact(matrix.tolist()))
        if abs(lowest) > 0.01:
            assert (diagonal is not None) == (lowest > 0)
        if diagonal is not None:
            assert proves_decay(diagonal, exact(matrix.tolist()))
        seen[diagonal is not None] += 1
    assert min(seen.values()) > 30


@pytest.mark.parametrize(
    ("matrix", "there_is"),
    [
        ([[0.5]], True),
        ([[1.0]], False),
        ([[0.9, 100.0], [0.0, -0.9]], True),
        ([[0.9, 0.0], [100.0, 0.9]], True),
        ([[0.9, 0.0], [0.0, 0.9]], True),
        ([[1.0, 0.0], [0.0, 0.9]], False),
        ([[0.6, -0.8], [0.8, 0.6]], False),
        ([[0.6, -0.79], [0.79, 0.6]], True),
        ([[0.6, -0.0079], [79.0, 0.6]], True),
        ([[0.1, 0.0, 0.0], [0.0, 0.1, 0.0], [0.0, 0.0, 0.1]], False),
    ],
)
def test_certificates_of_special_matrices(matrix: list[list[float]], there_is: bool) -> None:
    """Triangular ones need unequal weights; a rotation is on the edge; three states are not searched."""
    assert (lyapunov_diagonal(exact(matrix)) is not None) == there_is


def test_weights_must_be_positive() -> None:
    assert proves_decay((Fraction(1),), exact([[0.5]]))
    assert not proves_decay((Fraction(-1),), exact([[2.0]]))


def test_the_manifest_tells_them_in_the_outputs_unit() -> None:
    design = example_design("flange_wear_bench.toml", realization="df1")
    entries = manifest(core_facts(design))["limit_cycles"]
    assert [entry["section"] for entry in entries] == [section.name for section in design.quantized.sections]
    for section, entry in zip(design.quantized.sections, entries, strict=True):
        found = limit_cycles(section.graph)
        lsb = design.datapath.output.lsb
        assert entry["largest"] == float(found.largest * lsb)
        assert entry["dead_band"] == float(found.dead_band * lsb)
        assert entry["none"] is False
    assert entries[0]["lyapunov"] == ["1"]
    assert entries[1]["lyapunov"] is None


@pytest.mark.slow
def test_design_shows_them() -> None:
    shown = {}
    for realization in ("df1", "normal"):
        arguments = ["design", str(EXAMPLES / "flange_wear_bench.toml"), "--realization", realization, "--details"]
        text = CliRunner().invoke(cli, arguments, env={"COLUMNS": "120"}).stdout
        table = text[text.index("Limit cycles") :]
        shown[realization] = re.findall(
            r"^ +section(\d) +(none, proven|\S+) +(\S+) +\S+ +\S+ +(.+?) *$", table, re.MULTILINE
        )
    assert [row[0] for row in shown["df1"]] == [row[0] for row in shown["normal"]] == ["0", "1", "2"]
    assert [row[1] == "none, proven" for row in shown["df1"]] == [False] * 3
    assert [row[1] == "none, proven" for row in shown["normal"]] == [True] * 3
    assert [row[3] for row in shown["df1"]] == ["1", "not needed", "not needed"]
