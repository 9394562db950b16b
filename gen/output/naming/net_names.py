r"""Names for the nets of a module that our source has none for: what each is for, or what it computes.

They are read off the text that Yosys writes, in which such nets have names with ``$``::

    if (\$7 ) busy <= \$9 ;           busy_load, busy_next      what a register is loaded by, and with
    if (\$8 ) busy <= 1'h0;           busy_reset
    assign \$2  = ~ ready;            not_ready                 one operator, of nets that have names
    assign \$3  = valid & \$2 ;       valid_and_not_ready
    assign \$4 [31:0] = added;        added_wide                the bits that are left of a sum, and more
    assign ready[0] = \slice$5 ;      ready_0                   a bit of a register
    assign busy_next = \$7  ? ..       busy_next_part            what only helps to make another one
    \$6 , \i0$21                      n6, i0_21                 whatever has no short name

Names say what the text says beside them; two tools that read one text read the same hardware, whatever they are.
"""

from __future__ import annotations

import re

ESCAPED = re.compile(r"\\([A-Za-z0-9_$.:]*\$[A-Za-z0-9_$.:]*) ")
"""Names with ``$``, which need a backslash before and a space behind: Yosys makes them up for what has no name,
Amaranth for a second signal of the same name."""

_MADE_UP = re.compile(r"\$(?:.*:)?(?:[a-z]+mux|make_patterns_logic|combine_resets|Not|slice)?\$?(?P<number>\d+)(?:_Y)?")
_NET = r"(?:\\\S+ |[A-Za-z_]\w*)"
_PART = re.compile(rf"(?P<name>{_NET}) ?(?:\[(?P<high>\d+)(?::(?P<low>\d+))?\])?")
_WHOLE = re.compile(r"\\\S+ ?|[A-Za-z_]\w*")
_WORD = re.compile(r"\b_\d+_\b")
"""Registers that memories are read to, which Yosys numbers."""
_READ = re.compile(r"^ +(?P<word>_\d+_) <= (?P<memory>\w+)\[", re.MULTILINE)
_ASSIGN = re.compile(r"^  assign (?P<target>.*?) = (?P<value>.*);$", re.MULTILINE)
_LOAD = re.compile(
    rf"if \(!?(?P<condition>{_NET})\)\s+(?:if \(.*\)\s+)*(?P<register>{_NET})[^\n]*? <= (?P<value>[^\n]*);"
)
_VALUE = re.compile(
    rf"^ +(?:(?:else |if \(.*?\) )+)?(?P<register>{_NET}) ?(?:\[[\d:]+\])? <= (?P<value>{_NET})(?:\[[\d:]+\])?;",
    re.MULTILINE,
)
_PORT = re.compile(rf"^    \.(?P<port>\w+)\((?P<net>{_NET})\)", re.MULTILINE)
_NUMBER = re.compile(r"\d+'(?P<base>[hdb])(?P<digits>[0-9a-f]+)")
_UNARY = {"~": "not", "!": "not", "&": "all", "|": "any", "^": "odd"}
_BINARY = {
    "&": "and", "|": "or", "^": "xor", "+": "plus", "-": "minus", "*": "times",
    "==": "is", "!=": "is_not", "<": "below", ">": "above", "<=": "up_to", ">=": "from",
}  # fmt: skip
_DEEPEST = 12
_LONGEST = 48
"""Characters of a name that is made of others."""
_BASES = {"h": 16, "d": 10, "b": 2}


def plain_names(text: str) -> str:
    """Give the nets of a module names that need no escape, each one of its own."""
    taken = set(re.findall(r"\w+", text))
    naming = _Naming(text)
    names: dict[str, str] = {}

    def name_once(old: str, wanted: str) -> None:
        name, count = wanted, 1
        while name in taken:
            count += 1
            name = f"{wanted}_{count}"
        taken.add(name)
        names[old] = name

    for word, memory in _READ.findall(text):
        name_once(word, f"{memory}_read")
    for escaped in dict.fromkeys(ESCAPED.findall(text)):
        name_once(escaped, naming.name(escaped))
    text = _WORD.sub(lambda match: names.get(match[0], match[0]), text)
    return ESCAPED.sub(lambda match: names[match[1]], text)


class _Naming:
    """What is known of the nets of a module."""

    def __init__(self, text: str) -> None:
        self._roles = _roles(text)
        self._values: dict[str, str] = {}
        self._users: dict[str, str] = {}
        for target, value in _ASSIGN.findall(text):
            name = _made_up(target)
            if name is not None:
                self._values[name] = value
            part = _PART.fullmatch(target) or _PART.fullmatch(f"{target} ")
            for other in ESCAPED.findall(f"{value} ") if part else ():
                self._users.setdefault(other, part["name"] if part else "")
        self._known: dict[str, str | None] = {}

    def name(self, escaped: str) -> str:
        """Return the name of a net; others may have the same."""
        made_up = _MADE_UP.fullmatch(escaped)
        if made_up is None:
            return _plain(escaped)
        return self._meaning(escaped) or self._share(escaped) or f"n{made_up['number']}"

    def _share(self, escaped: str) -> str | None:
        """Return a name for a net that only helps to make another one, after that."""
        seen = {escaped}
        while escaped in self._users:
            user = self._users[escaped]
            made_up = _made_up(user)
            word = _plain(user) if made_up is None else self._meaning(made_up)
            if word is not None:
                return f"{word}_part" if len(word) <= _LONGEST else None
            if made_up is None or made_up in seen:
                return None
            seen.add(made_up)
            escaped = made_up
        return None

    def _meaning(self, escaped: str, depth: int = 0) -> str | None:
        """Return what a net is for, or computes of nets with names; None if that takes too many words."""
        if escaped not in self._known:
            self._known[escaped] = None  # of nets that depend on each other, bit by bit
            name = self._roles.get(escaped)
            if name is None and depth < _DEEPEST and escaped in self._values:
                name = self._computed(self._values[escaped], depth + 1)
            self._known[escaped] = name if name and len(name) <= _LONGEST and not name[0].isdigit() else None
        return self._known[escaped]

    def _computed(self, value: str, depth: int) -> str | None:
        """Return the words for an expression of one operator."""
        if value[0] in _UNARY:
            return self._one(value[0], value[1:].strip(), depth)
        choice = re.fullmatch(rf"({_NET}) ?\? (.*) : (.*)", value)
        parts = choice.groups() if choice else re.split(r" (==|!=|<=|>=|[-+*&|^<>]) ", value)
        if len(parts) != 3:
            return None
        words = [part if part in _BINARY else self._operand(part, depth) for part in parts]
        if None in words:
            return None
        first, second, third = (word or "" for word in words)
        return f"{first}_chooses_{second}_or_{third}" if choice else f"{first}_{_BINARY[second]}_{third}"

    def _one(self, operator: str, value: str, depth: int) -> str | None:
        """Return the words for an operator with one operand, or with several bits in braces."""
        if operator in "&|" and value[0] == "{":
            words = [self._operand(part, depth) for part in value.strip("{} ").split(", ")]
            return None if None in words else {"&": "_and_", "|": "_or_"}[operator].join(map(str, words))
        word = self._operand(value, depth)
        if word is None:
            return None
        return (
            word.removeprefix("not_")
            if operator == "~" and word.startswith("not_") and _is_single(word)
            else (f"{_UNARY[operator]}_{word}")
        )

    def _operand(self, value: str, depth: int) -> str | None:
        """Return the word for an operand: a net, bits of one, or a number."""
        value = value.removeprefix("$signed(").removesuffix(")").strip()
        number = _NUMBER.fullmatch(value)
        if number is not None:
            return str(int(number["digits"], _BASES[number["base"]]))
        part = _PART.fullmatch(value if value.startswith("\\") and "[" in value else f"{value} ")
        part = part or _PART.fullmatch(value)
        if part is None:
            return None
        made_up = _made_up(part["name"])
        word = _plain(part["name"]) if made_up is None else self._meaning(made_up, depth)
        return word and "_".join(filter(None, (word, part["high"], part["low"])))


def _is_single(word: str) -> bool:
    """Whether what a name inverts is one net."""
    return not re.search(r"_(?:and|or|xor|is|plus|minus|times|below|above|from|chooses)_", word)


def _made_up(target: str) -> str | None:
    """Return the made-up name that a whole net has; None if it is none, or has another one."""
    match = ESCAPED.fullmatch(target if target.endswith(" ") else f"{target} ")
    return match[1] if match and _MADE_UP.fullmatch(match[1]) else None


def _roles(text: str) -> dict[str, str]:
    """Return what nets with made-up names are for: what loads registers, what they load, and what is a part of what."""
    roles: dict[str, str] = {}

    def note(net: str, holder: str, role: str) -> None:
        made_up, other = _made_up(net), _made_up(holder)
        named = _plain(holder) if other is None else roles.get(other)
        if made_up is not None and named is not None:
            roles.setdefault(made_up, f"{named}_{role}")

    for target, value in _ASSIGN.findall(text):
        part = _PART.fullmatch(target.strip("{} ").split(", ")[-1])
        if part is None or not _WHOLE.fullmatch(value):
            continue
        if target.startswith("{"):
            note(value, part["name"], "parts")
            continue
        if part["high"] and _made_up(part["name"]) is not None:
            note(part["name"], value, "wide")
        else:
            note(value, part["name"], "_".join(filter(None, (part["high"], part["low"]))) or "net")
    for port in _PORT.finditer(text):
        made_up = _made_up(port["net"])
        if made_up is not None:
            roles.setdefault(made_up, port["port"])
    for load in _LOAD.finditer(text):
        loaded = load["value"]
        role = "load" if not _NUMBER.fullmatch(loaded) else "set" if re.search(r"'[hdb].*[1-9a-f]", loaded) else "reset"
        note(load["condition"], load["register"], role)
    for load in _VALUE.finditer(text):
        note(load["value"], load["register"], "next")
    return roles


def _plain(name: str) -> str:
    return re.sub(r"\W+", "_", name).strip("_")
