"""The register interface of a core behind a decimator is that of the whole, signal by signal."""

import pytest
from tests.verify.multirate.decimators import Case, check_rejected, designed, written

from sosmith.verify.multirate.cic import check_decimator

ONE, MANY = Case(reload=True, hold=False), Case(reload=True, channels=3, architecture="folded")


@pytest.mark.sweep(1)
@pytest.mark.parametrize("case", [ONE, MANY])
def test_registers_of_the_core_are_those_of_the_whole(case: Case) -> None:
    check_decimator(written(case), designed(case)[1], case.channels)


@pytest.mark.parametrize(
    ("right", "wrong", "sentence"),
    [
        (
            ".s_axil_awvalid(s_axil_awvalid)",
            ".s_axil_awvalid(s_axil_wvalid)",
            "s_axil_awvalid must go to the core as it is",
        ),
        (
            ".s_axil_wdata(s_axil_wdata)",
            ".s_axil_wdata({ s_axil_wdata[30:0], s_axil_wdata[31] })",
            "s_axil_wdata must go to the core as it is",
        ),
        (".s_axil_bready(s_axil_bready)", ".s_axil_bready(1'h1)", "s_axil_bready must go to the core as it is"),
        (
            "assign s_axil_bresp[0] = 1'h0;",
            "assign s_axil_bresp[0] = s_axil_bresp[1];",
            "s_axil_bresp must be that of the core, not another value",
        ),
        (
            "assign s_axil_rresp = { s_axil_bresp[1], 1'h0 };",
            "assign s_axil_rresp = { s_axil_rvalid, 1'h0 };",
            "s_axil_rresp must refuse what s_axil_bresp refuses",
        ),
        (
            ".s_axil_bvalid(s_axil_bvalid),\n",
            ".s_axil_bvalid(s_axil_rvalid),\n",
            "",
        ),
    ],
)
def test_another_register_interface_is_rejected(right: str, wrong: str, sentence: str) -> None:
    text = written(ONE)
    assert right in text  # first where the core is
    check_rejected(ONE, text.replace(right, wrong, 1), sentence or None)


def test_an_output_of_the_core_that_leaves_nowhere_is_found() -> None:
    text = written(ONE)
    right = "assign s_axil_rresp = { s_axil_bresp[1], 1'h0 };"
    wrong = "assign s_axil_rresp = 2'h0;"
    check_rejected(ONE, text.replace(right, wrong), "s_axil_rresp must be that of the core, not another value")
