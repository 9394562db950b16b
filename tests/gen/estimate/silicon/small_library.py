"""A small library of standard cells, as a Liberty file."""


def _pin(name: str, direction: str, rest: str = "") -> str:
    return f"pin({name}) {{ direction : {direction}; capacitance : 0.01; {rest} }}\n"


def _arc(of: str, kind: str = "combinational") -> str:
    table = '(table) { index_1 ("0, 1"); index_2 ("0, 1"); values ("0.5, 0.5", "0.5, 0.5"); }'
    tables = " ".join(f"{name} {table}" for name in ("cell_rise", "cell_fall", "rise_transition", "fall_transition"))
    return f'timing() {{ related_pin : "{of}"; timing_type : {kind}; timing_sense : negative_unate; {tables} }}'


def liberty() -> str:
    """Write a library of an inverter, three gates and a flip-flop, in which everything takes 0.5 ns."""
    gates = {"NAND2X1": (24, "!(A B)"), "NOR2X1": (24, "!(A+B)"), "XNOR2X1": (56, "!(A^B)")}
    inputs = _pin("A", "input") + _pin("B", "input")
    inverter = _pin("A", "input") + _pin("Y", "output", f'function : "(!A)"; {_arc("A")}')
    register = 'ff(IQ, IQN) { clocked_on : "CLK"; next_state : "D"; }' + _pin("D", "input")
    register += _pin("CLK", "input", "clock : true;")
    register += _pin("Q", "output", f'function : "IQ"; {_arc("CLK", "rising_edge")}')
    buffer = inverter.replace("!A", "A").replace("negative", "positive")
    cells = {"INVX4": (16, inverter), "BUFX2": (24, buffer), "DFFPOSX1": (96, register)}
    for name, (area, function) in gates.items():
        cells[name] = area, inputs + _pin("Y", "output", f'function : "({function})"; {_arc("A")} {_arc("B")}')
    text = "".join(f"cell ({name}) {{ area : {area}; {pins} }}\n" for name, (area, pins) in cells.items())
    units = 'time_unit : "1ns"; capacitive_load_unit (1,pf);'
    axes = 'variable_1 : total_output_net_capacitance; variable_2 : input_net_transition; index_1 ("0, 1");'
    template = f'lu_table_template(table) {{ {axes} index_2 ("0, 1"); }}'
    return f"library(small) {{\ndelay_model : table_lookup;\n{units}\n{template}\n{text} }}\n"
