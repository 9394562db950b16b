"""The key hardware.reload_lock: only for what can be loaded, and in all that says what the core is."""

import pytest
from tests.verify.parallel.cores import specified
from tests.verify.small_specifications import PLAIN

from sosmith.gen.core import design_core
from sosmith.gen.output.generate import generated
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
