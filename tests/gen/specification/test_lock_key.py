"""The keys hardware.reload_lock and reload_registers: only for what can be loaded, and in all that says what it is."""

import pytest
from tests.verify.parallel.cores import specified
from tests.verify.small_specifications import PLAIN

from sosmith.gen.core import design_core
from sosmith.gen.output.generate import generated
from sosmith.gen.output.identity import core_item
from sosmith.gen.output.packages.package import packed
from sosmith.model.errors import SpecificationError
from sosmith.verify.certificate_file import Certificate

KEYS = 'hardware.architecture = "folded"\nhardware.reload = true\n'


def test_a_lock_without_anything_to_load_is_refused() -> None:
    expected = r"hardware\.reload_lock must be false where nothing is loaded \(hardware\.reload = false\), not true"
    with pytest.raises(SpecificationError, match=expected):
        specified(PLAIN + "hardware.reload_lock = true\n")


@pytest.mark.slow
def test_hardware_registers_and_certificate_have_it() -> None:
    plain, locked = (
        generated(design_core(specified(PLAIN + KEYS + more))) for more in ("", "hardware.reload_lock = true\n")
    )
    assert "locked" in locked["plain.sv"]
    assert "locked" not in plain["plain.sv"]
    assert "PLAIN_STATUS_LOCKED" in locked["plain_registers.h"]
    assert "PLAIN_STATUS_LOCKED" not in plain["plain_registers.h"]
    of = [Certificate.model_validate_json(one["plain.certificate.json"]) for one in (plain, locked)]
    assert [c.about is not None and c.about.item is not None and c.about.item.reload_lock for c in of] == [False, True]


@pytest.mark.parametrize(
    ("lines", "beside"),
    [
        ('hardware.architecture = "folded"\n', r"hardware\.reload = false"),
        (KEYS + "hardware.reload_lock = true\n", r"hardware\.reload_lock = true"),
    ],
)
def test_pins_in_place_of_registers_have_something_to_load(lines: str, beside: str) -> None:
    with pytest.raises(SpecificationError, match=rf"hardware\.reload_registers must be true with {beside}, not false$"):
        specified(PLAIN + lines + "hardware.reload_registers = false\n")


def test_a_core_with_pins_says_so_and_is_for_a_chain_alone() -> None:
    core = design_core(specified(PLAIN + KEYS + "hardware.reload_registers = false\n"))
    files = generated(core)
    assert [name for name in files if "registers" in name or name.endswith(".rdl")] == []
    assert "reload_begun" in files["plain.sv"]
    assert "s_axil" not in files["plain.sv"]
    about = Certificate.model_validate_json(files["plain.certificate.json"]).about
    assert about is not None
    assert about.item is not None
    assert not about.item.reload_registers
    with pytest.raises(SpecificationError, match=r"hardware\.reload_registers must be true in a package"):
        packed(core)
    with pytest.raises(SpecificationError, match=r"hardware\.reload_registers must be true on a board"):
        core_item(core)
