"""GHDL analyses and elaborates the VHDL against a stub, and the bytes of the stream lie where the manifest says."""

import re
import subprocess
from pathlib import Path

import pytest
from tests.gen.output.packages.made import SPECIFICATIONS, unpacked

from sosmith.gen.output.packages.vhdl import vhdl_name


def ghdl(*arguments: str, at: Path) -> subprocess.CompletedProcess[str]:
    command, *rest = arguments
    return subprocess.run(
        ["ghdl", command, "--std=08", "-Werror", *rest], cwd=at, capture_output=True, text=True, check=False
    )


def with_stub(name: str, folder: Path) -> Path:
    """Write the package, and an entity with the ports of its component, whose result is its input."""
    at = unpacked(name, folder) / "vhdl"
    text = (at / f"{name}_package.vhd").read_text(encoding="utf-8")
    (ports,) = re.findall(r"port \(.*?\n    \);", text, flags=re.DOTALL)
    head = "library ieee; use ieee.std_logic_1164.all;\n"
    (at / "stub.vhd").write_text(
        f"{head}entity {name} is {ports} end;\narchitecture a of {name} is begin\n"
        "m_axis_tdata <= s_axis_tdata(m_axis_tdata'range);\nend;\n",
        encoding="utf-8",
    )
    return at


@pytest.mark.parametrize("name", SPECIFICATIONS)
def test_ghdl_elaborates_the_instance(name: str, tmp_path: Path) -> None:
    at = with_stub(name, tmp_path)
    for arguments in (("-a", "stub.vhd", f"{name}_package.vhd", f"{name}_instance.vhd"), ("-e", f"{name}_instance")):
        result = ghdl(*arguments, at=at)
        assert (result.returncode, result.stderr) == (0, "")


def test_ghdl_finds_a_port_of_another_width(tmp_path: Path) -> None:
    at = with_stub("plain", tmp_path)
    stub = at / "stub.vhd"
    stub.write_text(stub.read_text(encoding="utf-8").replace("(7 downto 0)", "(8 downto 0)"), encoding="utf-8")
    assert ghdl("-a", "stub.vhd", "plain_package.vhd", "plain_instance.vhd", at=at).returncode == 0
    assert ghdl("-e", "plain_instance", at=at).returncode + ghdl("-r", "plain_instance", at=at).returncode


def test_a_signed_code_passes_through(tmp_path: Path) -> None:
    at = with_stub("plain", tmp_path)
    (at / "check.vhd").write_text(
        """library ieee; use ieee.std_logic_1164.all; use ieee.numeric_std.all;
entity check is end;
architecture a of check is
  signal x_code, y_code : signed(9 downto 0);
begin
  core : entity work.plain_instance port map (
    x_code => x_code, y_code => y_code, aclk => '0', aresetn => '1', s_axis_tvalid => '1', m_axis_tready => '1',
    s_axis_tready => open, m_axis_tuser => open, m_axis_tvalid => open);
  process begin
    x_code <= to_signed(-300, 10);
    wait for 1 ns;
    assert y_code = -300 severity failure;
    wait;
  end process;
end;
""",
        encoding="utf-8",
    )
    assert ghdl("-a", "stub.vhd", "plain_package.vhd", "plain_instance.vhd", "check.vhd", at=at).returncode == 0
    ghdl("-e", "check", at=at)
    result = ghdl("-r", "check", at=at)
    assert (result.returncode, result.stderr) == (0, "")


def test_samples_of_a_beat_lie_in_their_order(tmp_path: Path) -> None:
    """The stub hands on the beat turned by one sample of 16 bits: result k is code k + 1, the last the first."""
    at = with_stub("wide", tmp_path)
    stub = at / "stub.vhd"
    text = stub.read_text(encoding="utf-8")
    turned = text.replace("s_axis_tdata(m_axis_tdata'range)", "s_axis_tdata(15 downto 0) & s_axis_tdata(127 downto 16)")
    assert turned != text
    stub.write_text(turned, encoding="utf-8")
    (at / "check.vhd").write_text(
        f"""library ieee; use ieee.std_logic_1164.all; use ieee.numeric_std.all;
entity check is end;
architecture a of check is
  type codes is array (0 to 7) of signed(9 downto 0);
  signal x, y : codes;
begin
  core : entity work.wide_instance port map (
    {", ".join(f"x_{k}_code => x({k}), y_{k}_code => y({k})" for k in range(8))},
    aclk => '0', aresetn => '1', s_axis_tvalid => '1', m_axis_tready => '1', s_axis_tready => open,
    m_axis_tuser => open, m_axis_tvalid => open);
  process begin
    for k in 0 to 7 loop x(k) <= to_signed(100 * k - 350, 10); end loop;
    wait for 1 ns;
    for k in 0 to 7 loop
      assert y(k) = 100 * ((k + 1) mod 8) - 350 severity failure;
    end loop;
    wait;
  end process;
end;
""",
        encoding="utf-8",
    )
    for source in ("stub.vhd", "wide_package.vhd", "wide_instance.vhd", "check.vhd"):
        result = ghdl("-a", source, at=at)
        assert (result.returncode, result.stderr) == (0, "")
    ghdl("-e", "check", at=at)
    result = ghdl("-r", "check", at=at)
    assert (result.returncode, result.stderr) == (0, "")


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("plain", "plain"),
        ("a_b2", "a_b2"),
        ("Signal", "\\Signal\\"),
        ("a__b", "\\a__b\\"),
        ("_a", "\\_a\\"),
        ("a_", "\\a_\\"),
    ],
)
def test_names_that_vhdl_does_not_take_are_extended(name: str, expected: str) -> None:
    assert vhdl_name(name) == expected
